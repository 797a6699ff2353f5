//! Tables in Markdown.
use drawloom_output::print_line;

/// A table. Columns are as wide as their longest cell. Columns of numbers are aligned to the right.
pub struct Table {
    lines: Vec<Vec<String>>,
}

impl Table {
    pub fn new(headings: &[&str]) -> Self {
        Self { lines: vec![headings.iter().map(|&heading| heading.to_owned()).collect()] }
    }

    pub fn row<const COLUMNS: usize>(&mut self, cells: [String; COLUMNS]) {
        self.lines.push(cells.into());
    }

    pub fn print(&self) {
        let columns = 0..self.lines[0].len();
        let width_of = |column: usize| self.lines.iter().map(|line| line[column].chars().count()).max().unwrap_or(0);
        let is_number =
            |cell: &String| cell.is_empty() || cell.starts_with(|first: char| "-0123456789".contains(first));
        let numeric =
            |column: usize| self.lines[1..].iter().all(|line| is_number(&line[column]) && !line[column].contains(' '));
        let columns: Vec<_> = columns.map(|column| (width_of(column).max(3), numeric(column))).collect();
        for (index, line) in self.lines.iter().enumerate() {
            let aligned = line.iter().zip(&columns).map(|(cell, &(width, right))| {
                if right { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
            });
            print_line!("| {} |", aligned.collect::<Vec<_>>().join(" | "));
            if index == 0 {
                let ruled =
                    columns.iter().map(
                        |&(width, right)| {
                            if right { format!("{}:", "-".repeat(width - 1)) } else { "-".repeat(width) }
                        },
                    );
                print_line!("| {} |", ruled.collect::<Vec<_>>().join(" | "));
            }
        }
        print_line!();
    }
}
