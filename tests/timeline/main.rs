//! What timelines record, and what is made of it for those who look at one.

mod chrome;
mod chrome_by_hand;
mod chrome_golden;
mod page;
mod report;
mod report_properties;
mod trace;
