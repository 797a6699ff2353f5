//! The table of stages in `ARCHITECTURE.md` has the rows of the one in `src/frame/stages/mod.rs`.

use std::fs;
use std::path::Path;

/// Name, owner, and the stages that it waits for.
type Row = (String, String, Vec<String>);

#[test]
fn architecture_has_the_table_of_stages() {
    let read = |path: &str| fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect(path);
    let (code, text) = (rows_of_code(&read("src/frame/stages/mod.rs")), rows_of_text(&read("ARCHITECTURE.md")));
    assert!(code.len() > 20, "{} stages found", code.len());
    assert_eq!(text, code);
}

/// The rows of `Stage::ALL`, one a line: calls of `stage` with these arguments, and others.
fn rows_of_code(code: &str) -> Vec<Row> {
    let row = |line: &str| {
        let (name, rest) = line.trim_start().strip_prefix("stage(\"")?.split_once("\", ")?;
        let (owner, rest) = rest.split_once(", &[")?;
        let after = rest.split_once(']')?.0.split(", ").filter(|name| !name.is_empty());
        Some((name.to_owned(), owner.to_lowercase(), after.map(|name| name.trim_matches('"').to_owned()).collect()))
    };
    code.lines().filter_map(row).collect()
}

/// The rows of the Markdown table that begins with the column *stage*.
fn rows_of_text(text: &str) -> Vec<Row> {
    let rows = text.lines().skip_while(|line| !line.starts_with("| stage | of | after |")).skip(2);
    let row = |line: &str| {
        let mut cells = line.trim_matches('|').split('|').map(str::trim);
        let mut next = || cells.next().unwrap_or_default().to_owned();
        let (name, owner, after) = (next(), next(), next());
        (name, owner, after.split(", or ").filter(|name| !name.is_empty()).map(str::to_owned).collect())
    };
    rows.take_while(|line| line.starts_with('|')).map(row).collect()
}

#[test]
fn a_row_that_differs_is_found() {
    let code = rows_of_code(
        r#"
            stage("bins", Frame, &["objects"], always, one),
            #[cfg(feature = "occlusion")]
            stage("join", Pass, &["bin", "sort"], always, one).with_costs_of("bin"),
        "#,
    );
    let text = |after: &str| {
        rows_of_text(&format!(
            "| stage | of | after |\n|--|--|--|\n| bins | frame | objects |\n| join | pass | {after} |\n"
        ))
    };
    assert_eq!(text("bin, or sort"), code);
    assert_ne!(text("bin"), code);
    assert_ne!(text("sort, or bin"), code);
}
