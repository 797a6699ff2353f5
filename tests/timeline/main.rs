//! What timelines record, and what is reported of it.

mod report;
mod report_properties;
