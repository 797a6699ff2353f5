//! A program has only one global subscriber, so this test has a binary of its own.

use drawloom_tracy::{InstallError, Zones};

#[test]
fn a_second_subscriber_is_an_error() {
    assert_eq!(drawloom_tracy::install(Zones::Nodes), Ok(()));
    assert_eq!(drawloom_tracy::install(Zones::Chunks), Err(InstallError));
    assert!(InstallError.to_string().contains("drawloom_tracy::layer"));
}
