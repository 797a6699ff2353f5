//! Reports, pages and Chrome traces of logs.

pub mod adversarial_names;
mod chrome;
mod chrome_edge_cases;
mod chrome_golden;
mod page;
mod report;
mod report_properties;
mod trace;
