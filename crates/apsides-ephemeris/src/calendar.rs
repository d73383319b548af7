//! Days of the Gregorian calendar as numbers.
//!
//! E. G. Richards, in Urban and Seidelmann (eds.), Explanatory Supplement to the Astronomical Almanac, 3rd ed., 2013, section 15.11.

/// Days from 2000-01-01 to a date.
pub(crate) fn day_number(year: i64, month: i64, day: i64) -> i64 {
    // Years begin in March, so that a leap day is the last.
    let (year, month) = if month <= 2 { (year - 1, month + 9) } else { (year, month - 3) };
    let of_year = (153 * month + 2) / 5 + day - 1;
    365 * year + year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400) + of_year - 730_425
}

/// Year, month and day of a number of days from 2000-01-01.
pub(crate) fn date(number: i64) -> [i64; 3] {
    let days = number + 730_425;
    let era = days.div_euclid(146_097);
    let of_era = days.rem_euclid(146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let year = year + 400 * era;
    if month < 10 { [year, month + 3, day] } else { [year + 1, month - 9, day] }
}

/// Number of days of a month.
pub(crate) fn days_of(year: i64, month: i64) -> i64 {
    let [next_year, next] = if month == 12 { [year + 1, 1] } else { [year, month + 1] };
    day_number(next_year, next, 1) - day_number(year, month, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_there_and_back() {
        assert_eq!(day_number(2000, 1, 1), 0);
        assert_eq!(day_number(1972, 1, 1), -10_227);
        assert_eq!(day_number(2030, 1, 1), 10_958);
        for number in -40_000..40_000 {
            let [year, month, day] = date(number);
            assert_eq!(day_number(year, month, day), number);
        }
        assert_eq!(
            [days_of(2000, 2), days_of(1900, 2), days_of(2024, 2), days_of(2023, 12)],
            [29, 28, 29, 31]
        );
    }
}
