#![allow(clippy::unwrap_used)]

use super::*;

fn epoch(text: &str) -> Epoch {
    text.parse().unwrap()
}

#[test]
fn dates_are_written_as_they_are_read() {
    for text in [
        "2030-01-01T00:00:00 TDB",
        "2016-12-31T23:59:60.5 UTC",
        "2017-01-01T00:00:00 UTC",
        "1972-06-30T23:59:60 UTC",
        "1999-02-28T13:05:09.000000001 TAI",
        "2100-12-31T23:59:59.999999999 TT",
        "1900-01-01T00:00:00.25 TDB",
    ] {
        assert_eq!(epoch(text).to_string(), text);
    }
    assert_eq!(epoch("2024-060T01:02:03Z").to_string(), "2024-02-29T01:02:03 UTC");
    assert_eq!(epoch("2030-01-01 TT").to_string(), "2030-01-01T00:00:00 TT");
    assert_eq!(epoch("2030-01-01 06:30 tai").to_string(), "2030-01-01T06:30:00 TAI");
    // Rounding carries into the next year.
    let last = epoch("2029-12-31T23:59:59.9999999999 TAI");
    assert_eq!(last.to_string(), "2030-01-01T00:00:00 TAI");
}

/// By the definitions: TT - TAI is 32.184 s, TAI - UTC 37 s.
#[test]
fn scales_differ_by_their_offsets() {
    let utc = epoch("2026-07-01T12:00:00 UTC");
    assert_eq!(utc.in_scale(TimeScale::Tai).to_string(), "2026-07-01T12:00:37 TAI");
    assert_eq!(utc.in_scale(TimeScale::Tt).to_string(), "2026-07-01T12:01:09.184 TT");
    assert_eq!(Epoch::of_unix(0).to_string(), "1970-01-01T00:00:00 UTC");
    assert_eq!(Epoch::of_unix(1_782_907_200).to_string(), "2026-07-01T12:00:00 UTC");
    let across = epoch("2016-12-31T23:59:59 UTC").later(2.0);
    assert_eq!(across.to_string(), "2017-01-01T00:00:00 UTC");
}

/// A clock of TDB and one of TT drift apart by at most 3.4e-10 of the time, and come back after a year.
#[test]
fn elapsed_time_is_that_of_the_scale() {
    let begin = epoch("2030-01-01T00:00:00 TDB");
    assert_eq!(begin.elapsed(86_400.0).to_string(), "2030-01-02T00:00:00 TDB");
    assert_ne!(begin.later(86_400.0), begin.elapsed(86_400.0));
    assert_eq!(epoch("2030-01-01T00:00:00 TT").elapsed(0.5).to_string(), "2030-01-01T00:00:00.5 TT");
    assert!(begin.elapsed(86_400.0).since(&begin) - 86_400.0 < 86_400.0 * 3.4e-10);
}

#[test]
fn what_is_no_epoch_is_refused_with_what_is_allowed() {
    for (text, words) in [
        ("2030-01-01T00:00:00", "must end with TAI, TT, TDB or UTC"),
        ("", "must end with"),
        ("soon TDB", "the date must be"),
        ("2030-02-30T00:00:00 TDB", "of a day that there is"),
        ("2030-13-01 TDB", "of a day that there is"),
        ("2030-366T00:00:00 TDB", "of a day that there is"),
        ("2030-01-01T24:00:00 TDB", "hours:minutes:seconds"),
        ("2030-01-01T00:00:61 TDB", "hours:minutes:seconds"),
        ("2030-01-01T00:00:nan TDB", "hours:minutes:seconds"),
        ("2030-01-01T23:59:60 TDB", "only UTC has leap seconds"),
        ("2026-12-31T23:59:60 UTC", "no leap second"),
        ("1971-12-31T00:00:00 UTC", "begins with 1972"),
        ("1899-12-31T00:00:00 TT", "from 1900 to 2100"),
        ("9999-12-31T00:00:00 TT", "from 1900 to 2100"),
        ("-2030-01-01T00:00:00 TT", "the date must be"),
    ] {
        let message = text.parse::<Epoch>().unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}

/// Times without sense make epochs without sense, and no panic.
#[test]
fn far_times_are_no_panic() {
    for seconds in [1e300, -1e300, f64::NAN, f64::INFINITY, 1e18, -9.3e18] {
        let far = epoch("2030-01-01T00:00:00 TDB").elapsed(seconds);
        for scale in TimeScale::ALL {
            assert!(!far.in_scale(scale).calendar().is_empty());
        }
    }
}
