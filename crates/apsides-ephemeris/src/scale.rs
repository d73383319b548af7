//! Time scales: atomic time, terrestrial and barycentric dynamical time, coordinated universal time.

use crate::calendar::day_number;

/// A time scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimeScale {
    /// International atomic time.
    Tai,
    /// Terrestrial time, TAI + 32.184 s.
    Tt,
    /// Barycentric dynamical time, within 2 ms of TT.
    Tdb,
    /// Coordinated universal time, from 1972 on. No leap second is known after 2017-01-01: later dates have TAI - UTC = 37 s.
    Utc,
}

/// TT - TAI, s.
pub(crate) const TT_TAI: f64 = 32.184;

/// Dates from which TAI - UTC has a value (s): IERS Bulletin C, 1972 to 2016; none has been announced since.
const LEAP_SECONDS: [(i64, i64, i64); 28] = [
    (1972, 1, 10),
    (1972, 7, 11),
    (1973, 1, 12),
    (1974, 1, 13),
    (1975, 1, 14),
    (1976, 1, 15),
    (1977, 1, 16),
    (1978, 1, 17),
    (1979, 1, 18),
    (1980, 1, 19),
    (1981, 7, 20),
    (1982, 7, 21),
    (1983, 7, 22),
    (1985, 7, 23),
    (1988, 1, 24),
    (1990, 1, 25),
    (1991, 1, 26),
    (1992, 7, 27),
    (1993, 7, 28),
    (1994, 7, 29),
    (1996, 1, 30),
    (1997, 7, 31),
    (1999, 1, 32),
    (2006, 1, 33),
    (2009, 1, 34),
    (2012, 7, 35),
    (2015, 7, 36),
    (2017, 1, 37),
];

impl TimeScale {
    /// All scales.
    pub const ALL: [Self; 4] = [Self::Tai, Self::Tt, Self::Tdb, Self::Utc];

    /// The name of the scale.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Tai => "TAI",
            Self::Tt => "TT",
            Self::Tdb => "TDB",
            Self::Utc => "UTC",
        }
    }
}

/// TDB - TT (s) at an instant of either, in s from J2000, to 10 microseconds from 1600 to 2200 (USNO Circular 179, eq. 2.6).
pub(crate) fn tdb_tt(seconds: f64) -> f64 {
    let t = seconds / (86_400.0 * 36_525.0);
    0.001_657 * (628.307_6 * t + 6.240_1).sin()
        + 0.000_022 * (575.338_5 * t + 4.297_0).sin()
        + 0.000_014 * (1_256.615_2 * t + 6.196_9).sin()
        + 0.000_005 * (606.977_7 * t + 4.021_2).sin()
        + 0.000_005 * (52.969_1 * t + 0.444_4).sin()
        + 0.000_002 * (21.329_9 * t + 5.543_1).sin()
        + 0.000_010 * t * (628.307_6 * t + 4.249_0).sin()
}

/// TAI - UTC (s) on a day, counted from 2000-01-01; none before 1972.
pub(crate) fn tai_utc(day: i64) -> Option<i64> {
    let begun = LEAP_SECONDS.iter().rev().find(|(year, month, _)| day_number(*year, *month, 1) <= day);
    begun.map(|(.., offset)| *offset)
}

/// TAI - UTC (s) at an instant in whole s of TAI from 2000-01-01T00:00:00 TAI, and whether it is within a leap second; none before 1972.
pub(crate) fn tai_utc_at(tai: i64) -> Option<(i64, bool)> {
    let begins = |(year, month, offset): &(i64, i64, i64)| 86_400 * day_number(*year, *month, 1) + offset;
    let next = LEAP_SECONDS.partition_point(|entry| begins(entry) <= tai);
    let (.., offset) = LEAP_SECONDS.get(next.checked_sub(1)?)?;
    // The second before a new offset begins is the one that is inserted.
    let inserted = LEAP_SECONDS.get(next).is_some_and(|entry| begins(entry) - 1 == tai);
    Some((*offset, inserted))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leap_seconds_are_inserted_at_the_ends_of_months() {
        assert_eq!(tai_utc(day_number(1971, 12, 31)), None);
        assert_eq!(tai_utc(day_number(2016, 12, 31)), Some(36));
        assert_eq!(tai_utc(day_number(2017, 1, 1)), Some(37));
        let begin = 86_400 * day_number(2017, 1, 1);
        assert_eq!(tai_utc_at(begin + 35), Some((36, false)));
        assert_eq!(tai_utc_at(begin + 36), Some((36, true)));
        assert_eq!(tai_utc_at(begin + 37), Some((37, false)));
        assert_eq!(tai_utc_at(86_400 * day_number(1971, 12, 31)), None);
    }
}
