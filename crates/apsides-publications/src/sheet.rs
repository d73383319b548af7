//! Tables of any columns, with figures and findings.

/// A table with columns of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sheet {
    /// Short name, also that of its files: `table-2`.
    pub id: &'static str,
    /// Number and subject.
    pub title: String,
    /// The heading of the labels, which tell the rows apart.
    pub heading: &'static str,
    /// Columns after the heading.
    pub columns: Vec<Column>,
    /// Rows, top down.
    pub rows: Vec<SheetRow>,
    /// Findings from the numbers, one sentence each.
    pub findings: Vec<String>,
    /// Figures of the numbers.
    pub graphs: Vec<Graph>,
    /// Solves that did not converge; their numbers are missing.
    pub failures: Vec<String>,
    /// Optima that the certificate does not confirm.
    pub unverified: Vec<String>,
    /// Wall-clock time that it took, s.
    pub seconds: f64,
}

/// A column of a [`Sheet`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    /// Name of the quantity; the unit ends it.
    pub key: &'static str,
    /// Digits after the point.
    pub decimals: usize,
    /// True where one stands for yes and zero for no.
    pub is_flag: bool,
}

/// A row of a [`Sheet`].
#[derive(Clone, Debug, PartialEq)]
pub struct SheetRow {
    /// The label that tells it from the others.
    pub label: String,
    /// One value per column, none where there is nothing to state.
    pub values: Vec<Option<f64>>,
}

/// A figure with several series.
#[derive(Clone, Debug, PartialEq)]
pub struct Graph {
    /// File name.
    pub file: &'static str,
    /// Title.
    pub title: String,
    /// Name and unit of the abscissa.
    pub x: (&'static str, &'static str),
    /// Name and unit of the ordinate.
    pub y: (&'static str, &'static str),
    /// Series, in the order of their colours; one without points keeps its colour free.
    pub series: Vec<GraphSeries>,
}

/// A series with the one it is compared to, in the same colour.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphSeries {
    /// Name.
    pub label: String,
    /// Drawn as a line.
    pub line: Vec<[f64; 2]>,
    /// Drawn as dots.
    pub dots: Vec<[f64; 2]>,
}

impl Sheet {
    pub(super) fn new(
        id: &'static str,
        title: impl Into<String>,
        heading: &'static str,
        columns: &[(&'static str, usize)],
    ) -> Self {
        let columns =
            columns.iter().map(|&(key, decimals)| Column { key, decimals, is_flag: false }).collect();
        Self { id, title: title.into(), heading, columns, ..Self::default() }
    }

    /// The same sheet, whose columns of these keys say yes or no.
    pub(super) fn with_flags(mut self, keys: &[&str]) -> Self {
        for column in self.columns.iter_mut().filter(|column| keys.contains(&column.key)) {
            column.is_flag = true;
        }
        self
    }

    pub(super) fn push(&mut self, label: impl Into<String>, values: Vec<Option<f64>>) {
        debug_assert_eq!(values.len(), self.columns.len(), "one value per column");
        self.rows.push(SheetRow { label: label.into(), values });
    }

    /// The value of a row in the column of this key, if there is one.
    #[must_use]
    pub fn value(&self, row: &str, key: &str) -> Option<f64> {
        let column = self.columns.iter().position(|c| c.key == key)?;
        self.rows.iter().find(|r| r.label == row)?.values[column]
    }
}

/// The value in the middle, or the mean of the two there.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    let middle = values.len() / 2;
    let upper = *values.get(middle)?;
    let lower = if values.len().is_multiple_of(2) { values[middle - 1] } else { upper };
    Some(0.5 * (lower + upper))
}
