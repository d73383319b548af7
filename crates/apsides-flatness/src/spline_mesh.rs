//! Splines and collocation points of one phase, and their refinement.
//!
//! Refinement goes to orthogonal collocation (C. de Boor and B. Swartz, *SIAM J. Numer. Anal.* 10 (1973) 582, doi
//! 10.1137/0710052): with `s` Gauss points in each segment, output `i` of highest derivative `q_i` has order `s + q_i` and knots of
//! multiplicity `s`, so that it has as many coefficients per segment as there are points, and exactly the states are continuous.

use apsides_basis::{BasisError, Bspline, Gauss, Lobatto, MAX_ORDER, MAX_POINTS, chebyshev_lobatto};
use apsides_ocp::Phase;

use crate::settings::{Breaks, Placement, SPARE_ORDERS, SplineSettings};
use crate::{FlatSystem, FlatnessError};

/// Splines and points of one phase.
#[derive(Clone, Debug)]
pub(crate) struct SplineMesh {
    /// One basis per output, all with the same breaks.
    pub(crate) bases: Vec<Bspline>,
    /// Ends of the segments, from 0 to 1.
    pub(crate) breaks: Vec<f64>,
    /// Collocation points, ascending, within [0, 1].
    pub(crate) points: Vec<f64>,
    /// Fewest points that determine the outputs.
    pub(crate) least: usize,
    /// Points per segment, once the mesh is one of orthogonal collocation.
    pub(crate) per_segment: Option<usize>,
}

impl SplineMesh {
    /// The mesh of the settings.
    ///
    /// # Errors
    /// A setting out of range.
    pub(crate) fn new(
        phase: &Phase,
        system: &FlatSystem,
        settings: &SplineSettings,
    ) -> Result<Self, FlatnessError> {
        let place = || format!("phase `{}`", phase.name);
        let refuse = |name, value: usize, allowed: String| {
            Err(FlatnessError::Setting { place: place(), name, value: value as f64, allowed })
        };
        let named = |source: BasisError| FlatnessError::Basis { place: place(), source };
        let q = system.highest_derivative();
        let order = settings.order.unwrap_or(q + SPARE_ORDERS);
        let lowest = (q + 1).max(2);
        if !(lowest..=MAX_ORDER).contains(&order) {
            let allowed = format!(
                "{lowest} to {MAX_ORDER} (the flat map takes derivative {q}, so that the order must be above it)"
            );
            return refuse("order", order, allowed);
        }
        let basis = match &settings.breaks {
            Breaks::Uniform(segments) | Breaks::Collocation(segments) => {
                if !(1..=100_000).contains(segments) {
                    return refuse("segments", *segments, "1 to 100000".into());
                }
                let joint = if matches!(settings.breaks, Breaks::Uniform(_)) { 1 } else { order - q };
                Bspline::clamped(order, &equal(*segments), &vec![joint; segments - 1]).map_err(named)?
            }
            Breaks::At { fractions, multiplicities } => {
                let highest = order - q;
                if let Some(m) = multiplicities.iter().find(|m| !(1..=highest).contains(*m)) {
                    let allowed = format!(
                        "1 to {highest} (order {order} less derivative {q}, so that the states are continuous)"
                    );
                    return refuse("multiplicity", *m, allowed);
                }
                if let Some(&f) = [fractions.first(), fractions.last()]
                    .into_iter()
                    .flatten()
                    .zip([0.0, 1.0])
                    .find_map(|(f, end)| (*f != end).then_some(f))
                {
                    let allowed = "0 for the first and 1 for the last break".into();
                    return Err(FlatnessError::Setting { place: place(), name: "breaks", value: f, allowed });
                }
                Bspline::clamped(order, fractions, multiplicities).map_err(named)?
            }
        };
        let breaks = basis.breaks();
        let least = least_points(system, &basis, settings.placement);
        let most = match settings.placement {
            Placement::Gauss | Placement::Lobatto | Placement::GaussPerSegment => MAX_POINTS,
            Placement::Chebyshev => 4096,
            Placement::Uniform | Placement::Greville => 1_000_000,
        };
        if !(least..=most).contains(&settings.points) {
            return refuse("points", settings.points, format!("{least} to {most} with these splines"));
        }
        let points = collocation_points(&basis, &breaks, settings).map_err(named)?;
        let least = match settings.placement {
            Placement::GaussPerSegment => least * (breaks.len() - 1),
            _ => least,
        };
        let mut mesh = Self { bases: vec![basis; system.outputs], breaks, points, least, per_segment: None };
        if let Breaks::Collocation(segments) = settings.breaks {
            let s = order - q;
            // Outputs of lower derivatives have lower orders, so that only their states are continuous.
            let joints = vec![s; segments - 1];
            for (basis, highest) in mesh.bases.iter_mut().zip(&system.highest) {
                *basis = Bspline::clamped(s + highest, &mesh.breaks, &joints).map_err(named)?;
            }
            let orthogonal = settings.placement == Placement::GaussPerSegment && settings.points == s;
            mesh.per_segment = orthogonal.then_some(s);
        }
        Ok(mesh)
    }

    /// Number of segments.
    pub(crate) fn segments(&self) -> usize {
        self.breaks.len() - 1
    }

    /// Highest order of the outputs.
    pub(crate) fn order(&self) -> usize {
        self.bases.iter().map(Bspline::order).max().unwrap_or(0)
    }

    /// The mesh of orthogonal collocation that contains these splines, raised by `raise` orders, and the same curves on it.
    pub(crate) fn orthogonal(
        &self,
        system: &FlatSystem,
        coefficients: &[Vec<f64>],
        raise: usize,
    ) -> Result<(Self, Vec<Vec<f64>>), BasisError> {
        let least = |(b, q): (&Bspline, &usize)| b.order() - q;
        let s = self.bases.iter().zip(&system.highest).map(least).max().unwrap_or(1) + raise;
        self.rebuilt(coefficients, s, self.breaks.clone(), &system.highest)
    }

    /// The mesh with the marked segments halved, and the same curves on it.
    pub(crate) fn halved(
        &self,
        system: &FlatSystem,
        coefficients: &[Vec<f64>],
        marked: impl Fn(usize) -> bool,
    ) -> Result<(Self, Vec<Vec<f64>>), BasisError> {
        let (whole, coefficients) = self.orthogonal(system, coefficients, 0)?;
        let mut breaks = vec![whole.breaks[0]];
        for (k, w) in whole.breaks.windows(2).enumerate() {
            if marked(k) {
                breaks.push(0.5 * (w[0] + w[1]));
            }
            breaks.push(w[1]);
        }
        let s = whole.per_segment.unwrap_or(1);
        whole.rebuilt(&coefficients, s, breaks, &system.highest)
    }

    fn rebuilt(
        &self,
        coefficients: &[Vec<f64>],
        s: usize,
        breaks: Vec<f64>,
        highest: &[usize],
    ) -> Result<(Self, Vec<Vec<f64>>), BasisError> {
        let (mut bases, mut curves) = (Vec::new(), Vec::new());
        for ((basis, c), q) in self.bases.iter().zip(coefficients).zip(highest) {
            let (mut basis, mut c) = (basis.clone(), c.clone());
            while basis.order() < s + q {
                (basis, c) = basis.elevate(&c)?;
            }
            for &x in &breaks[1..breaks.len() - 1] {
                while basis.multiplicity(x) < s {
                    (basis, c) = basis.insert_knot(x, &c)?;
                }
            }
            bases.push(basis);
            curves.push(c);
        }
        let points = per_segment(&breaks, s)?;
        let least = points.len();
        Ok((Self { bases, breaks, points, least, per_segment: Some(s) }, curves))
    }
}

/// As many points as an output has coefficients beyond its initial values: fewer leave it undetermined.
pub(crate) fn least_points(system: &FlatSystem, basis: &Bspline, placement: Placement) -> usize {
    let ends = match placement {
        Placement::Uniform | Placement::Lobatto | Placement::Chebyshev => 2,
        Placement::Greville => basis.order(),
        Placement::Gauss | Placement::GaussPerSegment => 1,
    };
    if system.residuals == 0 {
        return ends;
    }
    let needed = basis.len() - system.highest_derivative();
    match placement {
        Placement::GaussPerSegment => needed.div_ceil(basis.breaks().len() - 1),
        _ => needed.max(ends),
    }
}

fn collocation_points(
    basis: &Bspline,
    breaks: &[f64],
    settings: &SplineSettings,
) -> Result<Vec<f64>, BasisError> {
    let n = settings.points;
    let unit = |nodes: &[f64]| nodes.iter().map(|x| 0.5 * (x + 1.0)).collect();
    Ok(match settings.placement {
        Placement::Uniform => (0..n).map(|k| k as f64 / (n - 1) as f64).collect(),
        Placement::Gauss => unit(Gauss::shared(n)?.nodes()),
        Placement::Lobatto => unit(Lobatto::new(n)?.nodes()),
        Placement::Chebyshev => unit(&chebyshev_lobatto(n)?),
        Placement::Greville if n == basis.len() => basis.greville()?,
        Placement::Greville => Bspline::clamped_uniform(basis.order(), n + 1 - basis.order())?.greville()?,
        Placement::GaussPerSegment => per_segment(breaks, n)?,
    })
}

/// Ends of equal segments from 0 to 1.
fn equal(segments: usize) -> Vec<f64> {
    (0..=segments).map(|k| k as f64 / segments as f64).collect()
}

/// A Gauss rule of `n` points in each segment.
fn per_segment(breaks: &[f64], n: usize) -> Result<Vec<f64>, BasisError> {
    let rule = Gauss::shared(n)?;
    Ok(breaks
        .windows(2)
        .flat_map(|w| rule.nodes().iter().map(|x| w[0] + 0.5 * (w[1] - w[0]) * (x + 1.0)).collect::<Vec<_>>())
        .collect())
}
