//! Instants: read from and written as calendar dates in a time scale.

use std::fmt::{self, Display};
use std::str::FromStr;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::EphemerisError;
use crate::calendar::{date, day_number, days_of};
use crate::scale::{TT_TAI, TimeScale, tai_utc, tai_utc_at, tdb_tt};

/// An instant with the time scale in which it is said.
///
/// Two are equal when they are the same instant in the same scale. It resolves less than a nanosecond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Epoch {
    /// Whole seconds of TT from J2000, 2000-01-01T12:00:00 TT.
    whole: i64,
    /// The rest, s, from 0 to below 1.
    part: f64,
    scale: TimeScale,
}

/// Seconds of a day.
const DAY: i64 = 86_400;
/// Seconds from midnight to J2000.
const NOON: i64 = DAY / 2;
/// Years of epochs, within those of the models of the axes and of TDB.
const YEARS: std::ops::RangeInclusive<i64> = 1900..=2100;
/// Nanoseconds of a second.
const NANOSECONDS: i128 = 1_000_000_000;

impl Epoch {
    /// The epoch of missions that state none.
    pub const DEFAULT: &'static str = "2030-01-01T00:00:00 TDB";

    const fn new(whole: i64, part: f64, scale: TimeScale) -> Self {
        Self { whole, part, scale }
    }

    /// The instant so many seconds from J2000 in a scale that is not UTC.
    fn at(whole: i64, part: f64, scale: TimeScale) -> Self {
        let offset = match scale {
            TimeScale::Tai | TimeScale::Utc => TT_TAI,
            TimeScale::Tt => 0.0,
            TimeScale::Tdb => -tdb_tt(whole as f64 + part),
        };
        Self::new(whole, part, scale).later(offset)
    }

    /// The time scale.
    #[must_use]
    pub const fn scale(&self) -> TimeScale {
        self.scale
    }

    /// The same instant in another time scale.
    #[must_use]
    pub const fn in_scale(self, scale: TimeScale) -> Self {
        Self { scale, ..self }
    }

    /// Returns true if the scale has this instant: UTC begins in 1972.
    #[must_use]
    pub fn is_in(&self, scale: TimeScale) -> bool {
        scale != TimeScale::Utc || self.tai_day_seconds().is_some()
    }

    fn tai_day_seconds(&self) -> Option<(i64, bool)> {
        let tai = self.later(-TT_TAI);
        tai_utc_at(tai.whole.saturating_add(NOON))
    }

    /// The instant so many seconds later.
    #[must_use]
    pub fn later(self, seconds: f64) -> Self {
        let whole = seconds.floor();
        let part = self.part + (seconds - whole);
        let carry = part.floor();
        Self {
            whole: self.whole.saturating_add(whole as i64).saturating_add(carry as i64),
            part: part - carry,
            ..self
        }
    }

    /// The instant so many seconds later by a clock of TDB where that is the scale, and of atomic time otherwise.
    #[must_use]
    pub fn elapsed(self, seconds: f64) -> Self {
        match self.scale {
            TimeScale::Tdb => {
                let begin = self.tdb_seconds();
                self.later(seconds - (tdb_tt(begin + seconds) - tdb_tt(begin)))
            }
            _ => self.later(seconds),
        }
    }

    /// Seconds from another instant to this one.
    #[must_use]
    pub fn since(&self, earlier: &Self) -> f64 {
        self.whole.saturating_sub(earlier.whole) as f64 + (self.part - earlier.part)
    }

    /// Seconds of TDB from J2000, for models of what depends on time.
    #[must_use]
    pub fn tdb_seconds(&self) -> f64 {
        let tt = self.whole as f64 + self.part;
        tt + tdb_tt(tt)
    }

    /// Whole days of TDB from J2000 and seconds of the last: the seconds alone, over decades, have lost digits.
    pub(crate) fn tdb_days(&self) -> (f64, f64) {
        let seconds = self.whole.rem_euclid(DAY) as f64 + self.part;
        (self.whole.div_euclid(DAY) as f64, seconds + tdb_tt(self.whole as f64 + self.part))
    }

    /// Julian date in TDB.
    #[must_use]
    pub fn julian_date_tdb(&self) -> f64 {
        2_451_545.0 + self.tdb_seconds() / DAY as f64
    }

    /// The present instant by the clock of the computer; 1970 where that stands before it.
    #[must_use]
    pub fn now() -> Self {
        Self::of_unix(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
    }

    /// The instant of a number of seconds of the clock of computers, which counts from 1970-01-01T00:00:00 UTC without leap seconds.
    #[must_use]
    pub fn of_unix(seconds: u64) -> Self {
        let of_day = seconds as i64 + DAY * day_number(1970, 1, 1);
        let offset = tai_utc(of_day.div_euclid(DAY)).unwrap_or(10);
        Self::at(of_day + offset - NOON, 0.0, TimeScale::Utc)
    }

    /// Date and time of day in the scale, with so many digits of the second that no nanosecond is lost and none that is zero.
    #[must_use]
    pub fn calendar(&self) -> String {
        let (days, seconds, nanoseconds) = self.fields();
        let [year, month, day] = date(days);
        let (hour, minute, second) = match seconds {
            DAY => (23, 59, 60),
            s => (s / 3600, s / 60 % 60, s % 60),
        };
        let mut text = format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}");
        if nanoseconds > 0 {
            text += format!(".{nanoseconds:09}").trim_end_matches('0');
        }
        text
    }

    /// Days from 2000-01-01, seconds of the day, of which a leap second is the last, and nanoseconds, in the scale.
    fn fields(&self) -> (i64, i64, i128) {
        let offset = match self.scale {
            TimeScale::Tai | TimeScale::Utc => -TT_TAI,
            TimeScale::Tt => 0.0,
            TimeScale::Tdb => tdb_tt(self.whole as f64 + self.part),
        };
        let Self { whole, part, .. } = self.later(offset);
        let mut total = (i128::from(whole) + i128::from(NOON)) * NANOSECONDS + (part * 1e9).round() as i128;
        let mut leap = 0;
        if self.scale == TimeScale::Utc {
            let (offset, inserted) = tai_utc_at(total.div_euclid(NANOSECONDS) as i64).unwrap_or((10, false));
            total -= i128::from(offset + i64::from(inserted)) * NANOSECONDS;
            leap = i64::from(inserted);
        }
        let (seconds, nanoseconds) = (total.div_euclid(NANOSECONDS) as i64, total.rem_euclid(NANOSECONDS));
        (seconds.div_euclid(DAY), seconds.rem_euclid(DAY) + leap, nanoseconds)
    }

    /// Reads a date and a time of day in a scale: `2030-01-01T00:00:00.5`, `2030-001T00:00:00` or `2030-01-01`.
    ///
    /// # Errors
    /// [`EphemerisError::Epoch`] where the text is none, or the scale does not have the instant.
    pub fn in_calendar(text: &str, scale: TimeScale) -> Result<Self, EphemerisError> {
        let refuse = |reason: &str| EphemerisError::Epoch { text: text.into(), reason: reason.into() };
        let text = text.trim();
        let text = if scale == TimeScale::Utc { text.strip_suffix('Z').unwrap_or(text) } else { text };
        let (day, clock) = text.split_once(['T', ' ']).unwrap_or((text, "00:00:00"));
        let days = day_of(day).ok_or_else(|| {
            refuse("the date must be year-month-day or year-day, such as 2030-01-31, of a day that there is")
        })?;
        let [year, ..] = date(days);
        if !YEARS.contains(&year) {
            let (least, most) = (YEARS.start(), YEARS.end());
            return Err(refuse(&format!("the year must be from {least} to {most}")));
        }
        let (seconds, part) = clock_of(clock)
            .ok_or_else(|| refuse("the time of day must be hours:minutes:seconds, such as 23:59:59.5"))?;
        if scale != TimeScale::Utc {
            return match seconds < DAY {
                true => Ok(Self::at(days * DAY + seconds - NOON, part, scale)),
                false => Err(refuse("only UTC has leap seconds: the seconds must be below 60")),
            };
        }
        let offset = tai_utc(days)
            .ok_or_else(|| refuse("the table of leap seconds begins with 1972: use TAI, TT or TDB before"))?;
        if seconds == DAY && tai_utc(days + 1) == Some(offset) {
            return Err(refuse("this day has no leap second: the seconds must be below 60"));
        }
        Ok(Self::at(days * DAY + seconds + offset - NOON, part, scale))
    }
}

/// Days from 2000-01-01 of a date by month or by day of the year.
fn day_of(text: &str) -> Option<i64> {
    let number = |text: &str, digits: usize| {
        let is_number = text.len() == digits && text.bytes().all(|b| b.is_ascii_digit());
        is_number.then(|| text.parse::<i64>().ok()).flatten()
    };
    match text.split('-').collect::<Vec<_>>()[..] {
        [year, month, day] => {
            let (year, month, day) = (number(year, 4)?, number(month, 2)?, number(day, 2)?);
            let exists = (1..=12).contains(&month) && (1..=days_of(year, month)).contains(&day);
            exists.then(|| day_number(year, month, day))
        }
        [year, day] => {
            let (year, day) = (number(year, 4)?, number(day, 3)?);
            let first = day_number(year, 1, 1);
            (1..=day_number(year + 1, 1, 1) - first).contains(&day).then_some(first + day - 1)
        }
        _ => None,
    }
}

/// Whole seconds of the day and the rest; 86400 in a leap second.
fn clock_of(text: &str) -> Option<(i64, f64)> {
    let (whole, part) = text.split_once('.').unwrap_or((text, ""));
    if !part.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    let part: f64 = format!("0.{part}").parse().ok()?;
    let mut fields = whole.split(':').map(|field| {
        let is_number = field.len() == 2 && field.bytes().all(|b| b.is_ascii_digit());
        is_number.then(|| field.parse::<i64>().ok()).flatten()
    });
    let (hour, minute, second) = (fields.next()??, fields.next()??, fields.next().unwrap_or(Some(0))?);
    let exists = fields.next().is_none() && hour < 24 && minute < 60;
    let leap = second == 60 && hour == 23 && minute == 59;
    (exists && (second < 60 || leap)).then_some((3600 * hour + 60 * minute + second, part))
}

impl Display for Epoch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.calendar(), self.scale.word())
    }
}

impl FromStr for Epoch {
    type Err = EphemerisError;

    /// Reads a date, a time of day and the scale after them; a `Z` at the end is UTC.
    fn from_str(text: &str) -> Result<Self, EphemerisError> {
        let trimmed = text.trim();
        let named = trimmed.rsplit_once(' ').and_then(|(date, word)| {
            let scale = TimeScale::ALL.into_iter().find(|scale| scale.word().eq_ignore_ascii_case(word))?;
            Some((date, scale))
        });
        let zulu = || trimmed.strip_suffix('Z').map(|date| (date, TimeScale::Utc));
        let Some((date, scale)) = named.or_else(zulu) else {
            let reason = format!("it must end with TAI, TT, TDB or UTC, as in `{}`", Self::DEFAULT);
            return Err(EphemerisError::Epoch { text: text.into(), reason });
        };
        Self::in_calendar(date, scale)
    }
}

#[cfg(test)]
mod tests;
