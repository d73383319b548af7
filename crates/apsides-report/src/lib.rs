//! Figures, HTML reports and data files for apsides results.
