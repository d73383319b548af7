//! Solves of one problem again and again with other data: another initial state, target, mass or limit.

use std::time::Instant;

use apsides_nlp::{NlpSettings, Observer, Resolver};
use apsides_ocp::explicit_time::divided_mesh;
use apsides_ocp::{Guess, Mesh, Ocp, Trajectory, WithoutKinks};

use crate::RadauError;
use crate::mesh_solve::MeshSolve;
use crate::redundant::Irredundant;
use crate::solver::{Radau, RadauSolution};
use crate::transcription::Transcription;

/// A solution of a session.
#[derive(Clone, Debug)]
pub struct Resolved {
    /// The solution: of one mesh where that of the last solution serves, else of all meshes that were solved.
    pub solution: RadauSolution,
    /// True if it was found on the mesh of the last one, by Newton's method on the active set.
    pub followed: bool,
}

/// Re-solves of a problem on the mesh of its last solution: the analysis of the linear systems, the solution, its multipliers and its active
/// set are kept.
///
/// A small change takes two or three Newton steps on the active set. Where the set does not settle, or the mesh does not serve any more, the
/// problem is solved from the last solution as in [`Radau::solve_on`]: what a session finds is as accurate as what a solve without it finds.
/// Problems with kinks that are solved in another form are solved that way at once.
///
/// ```
/// use apsides_ad::{Dynamics, PathFunction, Scalar};
/// use apsides_ocp::{Bounds, Guess, Ocp, OcpError, Phase, State, Variable};
/// use apsides_radau::{Radau, Session};
///
/// struct Cart;
/// impl Dynamics<2, 1> for Cart {
///     fn rate<S: Scalar>(&self, _t: S, x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 2] {
///         [x[1], u[0]]
///     }
/// }
/// struct Effort;
/// impl PathFunction<2, 1, 1> for Effort {
///     fn evaluate<S: Scalar>(&self, _t: S, _x: &[S; 2], u: &[S; 1], _p: &[S; 0]) -> [S; 1] {
///         [u[0].square() * 0.5]
///     }
/// }
/// fn cart(distance: f64) -> Result<Ocp, OcpError> {
///     let x = State::new("x", "m").starts_at(0.0).ends_at(distance);
///     let phase = Phase::new("move", Cart)
///         .states([x, State::new("v", "m/s").starts_at(0.0).ends_at(0.0)])
///         .controls([Variable::new("a", "m/s2")])
///         .final_time(Bounds::fixed(1.0))
///         .integral(Variable::new("effort", "m2/s3"), Effort);
///     Ocp::builder("rest to rest").phase(phase).minimize_integral("move", "effort").build()
/// }
///
/// let ocp = cart(1.0)?;
/// let first = Radau::default().solve(&ocp, &Guess::linear(&ocp))?;
/// let mut session = Session::new(Radau::default(), first.trajectory);
/// let next = session.resolve(&cart(1.01)?, &mut ())?;
/// assert!(next.followed);
/// assert!((next.solution.trajectory.objective - 6.0 * 1.01 * 1.01).abs() < 1e-9); // closed form
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Session {
    radau: Radau,
    last: Trajectory,
    mesh: Mesh,
    /// None until the first solve on the mesh.
    resolver: Option<Resolver>,
}

impl Session {
    /// A session that goes on from a trajectory: of a solve, or read from a file.
    #[must_use]
    pub fn new(radau: Radau, solution: Trajectory) -> Self {
        Self { radau, mesh: solution.mesh(), last: solution, resolver: None }
    }

    /// Solves a problem of the same phases, states and controls as the last one, from its solution.
    ///
    /// # Errors
    /// When the request is ill-posed. Not converging is a status of the solution, and leaves the last solution as it was.
    pub fn resolve(&mut self, ocp: &Ocp, observer: &mut dyn Observer) -> Result<Resolved, RadauError> {
        self.radau.settings.check()?;
        let guess = Guess::earlier(&self.last);
        if self.mesh_serves(ocp, &guess)?
            && let Some(solution) = self.follow(ocp, &guess)?
        {
            self.last = solution.trajectory.clone();
            if solution.accurate {
                return Ok(Resolved { solution, followed: true });
            }
        }
        let solution = self.radau.solve_on(ocp, &Guess::earlier(&self.last), self.mesh.clone(), observer)?;
        if solution.status.is_success() {
            *self = Self::new(self.radau.clone(), solution.trajectory.clone());
        }
        Ok(Resolved { solution, followed: false })
    }

    /// True unless the problem is solved in another form, or time brings events between the ends of the intervals.
    fn mesh_serves(&self, ocp: &Ocp, guess: &Guess) -> Result<bool, RadauError> {
        guess.check(ocp)?;
        Ok(WithoutKinks::of(ocp).is_none()
            && Irredundant::of(ocp).is_none()
            && divided_mesh(ocp, guess, &self.mesh)?.is_none())
    }

    /// The solution on the last mesh; none where its active set does not lead there.
    fn follow(&mut self, ocp: &Ocp, guess: &Guess) -> Result<Option<RadauSolution>, RadauError> {
        let begin = Instant::now();
        let settings = &self.radau.settings;
        let mut nlp = Transcription::new(ocp, &self.mesh, guess)?.with_threads(settings.threads);
        let resolver = match &mut self.resolver {
            Some(resolver) => resolver,
            none => none.insert(first_resolver(&mut nlp, ocp, guess, &settings.nlp)?),
        };
        let Some(report) = resolver.follow(&mut nlp)? else { return Ok(None) };
        let solve = MeshSolve::of_report(ocp, nlp, settings, report)?;
        let record = solve.record(&self.mesh, begin.elapsed());
        Ok(Some(solve.into_solution(ocp, settings, record)))
    }
}

/// A resolver that starts from the guess and its costates, if it has any.
fn first_resolver(
    nlp: &mut Transcription,
    ocp: &Ocp,
    guess: &Guess,
    settings: &NlpSettings,
) -> Result<Resolver, RadauError> {
    Ok(match nlp.warm_start(ocp, guess) {
        Some(solution) => Resolver::from_solution(settings.clone(), solution)?,
        None => Resolver::new(settings.clone()),
    })
}
