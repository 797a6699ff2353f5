//! The extremes that every feature is tried at, and what is measured there: with `DRAWLOOM_ERROR_TABLE=1` the program
//! ends with a table.

use std::sync::{Mutex, PoisonError};

use drawloom::glam::DVec3;
use libtest_mimic::Failed;

/// Where in the world a scene is, and how large.
#[derive(Clone, Copy, Debug)]
pub struct Extreme {
    /// Its column of the table.
    pub name: &'static str,
    pub position: DVec3,
    pub scale: f64,
}

/// The columns of the table.
const COLUMNS: [&str; 5] = ["10⁶ m", "10⁹ m", "1e-6", "1e6", TOUCHING];

/// The column of cameras that touch what they see.
pub const TOUCHING: &str = "touching";

const DIRECTION: DVec3 = DVec3::new(0.6, -0.48, 0.64);

pub const EXTREMES: [Extreme; 4] = [
    Extreme {
        name: COLUMNS[0],
        position: DVec3::new(DIRECTION.x * 1e6, DIRECTION.y * 1e6, DIRECTION.z * 1e6),
        scale: 1.0,
    },
    Extreme {
        name: COLUMNS[1],
        position: DVec3::new(DIRECTION.x * 1e9, DIRECTION.y * 1e9, DIRECTION.z * 1e9),
        scale: 1.0,
    },
    Extreme { name: COLUMNS[2], position: DVec3::ZERO, scale: 1e-6 },
    Extreme { name: COLUMNS[3], position: DVec3::ZERO, scale: 1e6 },
];

/// 2⁻²⁴.
pub const UNIT_ROUNDOFF: f64 = 1.0 / (1_u32 << 24) as f64;

/// A row of the table: a feature, the unit of its errors, and for each column the error that was closest to its bound.
#[derive(Debug)]
struct Row {
    feature: &'static str,
    unit: &'static str,
    cells: [Option<[f64; 2]>; COLUMNS.len()],
}

static TABLE: Mutex<Vec<Row>> = Mutex::new(Vec::new());

/// Notes an error in the table, and fails unless it is within its bound.
pub fn expect_within(
    (feature, column, unit): (&'static str, &str, &'static str),
    context: &str,
    [measured, bound]: [f64; 2],
) -> Result<(), Failed> {
    let mut table = TABLE.lock().unwrap_or_else(PoisonError::into_inner);
    let index = table.iter().position(|row| row.feature == feature).unwrap_or(table.len());
    if index == table.len() {
        table.push(Row { feature, unit, cells: [None; COLUMNS.len()] });
    }
    let column = COLUMNS.iter().position(|name| *name == column).ok_or("no column has this name")?;
    let cell = &mut table[index].cells[column];
    // Of equal shares, the greater bound is the more telling one.
    let share = |[measured, bound]: [f64; 2]| [measured / bound.max(f64::MIN_POSITIVE), bound];
    if cell.is_none_or(|before| share(before) < share([measured, bound])) {
        *cell = Some([measured, bound]);
    }
    // False for NaN.
    if measured <= bound {
        Ok(())
    } else {
        Err(format!("{feature}, {context}: an error of {measured:.3e} {unit}, and at most {bound:.3e} is right").into())
    }
}

/// Prints the table, if the environment asks for it.
pub fn print() {
    if std::env::var_os("DRAWLOOM_ERROR_TABLE").is_none_or(|value| value != "1") {
        return;
    }
    let mut table = TABLE.lock().unwrap_or_else(PoisonError::into_inner);
    table.sort_by_key(|row| row.feature);
    println!("| measured / bound | unit | {} |", COLUMNS.join(" | "));
    println!("| --- | --- |{}", " --: |".repeat(COLUMNS.len()));
    for Row { feature, unit, cells } in table.iter() {
        let number = |value: f64| if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") };
        let text = |cell: &Option<[f64; 2]>| match cell {
            Some([measured, bound]) => format!("{} / {}", number(*measured), number(*bound)),
            None => "—".to_owned(),
        };
        println!("| {feature} | {unit} | {} |", cells.iter().map(text).collect::<Vec<_>>().join(" | "));
    }
}
