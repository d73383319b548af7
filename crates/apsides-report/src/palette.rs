//! Colours of figures and of their legends.

/// The colour of text.
pub(crate) const INK: &str = "#1F2933";
pub(crate) const FRAME: &str = "#8A949E";
pub(crate) const GRID: &str = "#E3E7EB";
pub(crate) const MINOR_GRID: &str = "#F1F3F5";
pub(crate) const SHADE: &str = "#F6F8FA";
/// The colour of bodies and ground.
pub(crate) const BODY: &str = "#DDE3E8";
/// The colour of bounds.
pub(crate) const BOUND: &str = "#6B7580";

/// Colours that readers with colour vision deficiency tell apart, without the yellow that white paper hides.
/// Okabe and Ito, Color Universal Design (2008), <https://jfly.uni-koeln.de/color/>.
pub(crate) const COLORS: [(&str, &str); 7] = [
    ("blue", "#0072B2"),
    ("vermilion", "#D55E00"),
    ("green", "#009E73"),
    ("purple", "#CC79A7"),
    ("orange", "#E69F00"),
    ("sky blue", "#56B4E9"),
    ("black", "#000000"),
];

/// Colour of a series.
pub(crate) fn series_color(index: Option<usize>) -> &'static str {
    index.map_or(BOUND, |k| COLORS[k % COLORS.len()].1)
}

/// Says whether an earlier series may have the colour of a series, which is then drawn in dashes.
pub(crate) fn is_repeated(index: Option<usize>) -> bool {
    index.is_some_and(|k| k >= COLORS.len())
}

/// Colour of a reference line: from the end of the palette, which few figures reach.
pub(crate) fn reference_color(index: usize) -> &'static str {
    COLORS[(COLORS.len() - 1) - index % COLORS.len()].1
}
