//! One sentence for each check: its meaning, and what makes it fail. Terminal, report and documentation have them from here.

use crate::{Check, CheckKind};

/// Part of the name of a check, and its sentence. The first that fits counts.
const SENTENCES: &[(CheckKind, &str, &str)] = {
    use CheckKind::{Convexity, Curvature, Feasibility, Optimality, Strictness};
    &[
        (
            Feasibility,
            "left when its re-simulation stopped",
            "The flight under the stated controls must reach the end of the phase; it fails at a singularity of the equations or \
             where they are stiffer than the steps allowed.",
        ),
        (
            Feasibility,
            "joins the re-simulated pieces",
            "Where errors grow so fast that no flight without feedback stays on its course, the phase is flown in pieces; so small a change of the \
             controls leads from the end of each to the start of the next one.",
        ),
        (
            Feasibility,
            "re-simulated ",
            "The state at the end of the flight, integrated again from the initial state under the stated controls, must be the \
             stated one; a mesh too coarse for the control or a tampered trajectory makes it fail.",
        ),
        (
            Feasibility,
            "against the re-simulation",
            "The stated states at the nodes must be those of the flight integrated again; interpolated or altered states make it fail.",
        ),
        (
            Feasibility,
            "boundary conditions",
            "Initial states and the re-simulated final states must be within their bounds.",
        ),
        (
            Feasibility,
            "bounds on the integrals",
            "Each integral over the re-simulated flight must be within its bounds.",
        ),
        (Feasibility, "bounds on the static parameters", "Each static parameter must be within its bounds."),
        (Feasibility, "times of", "Start, end and duration of the phase must be within their bounds."),
        (
            Feasibility,
            "objective",
            "The objective computed from the re-simulated flight must be the stated one.",
        ),
        (
            Feasibility,
            "constraint ",
            "A condition between ends of phases must hold at the re-simulated ends.",
        ),
        (
            Feasibility,
            "control bounds",
            "The controls must be within their bounds everywhere, between the nodes too; an interpolation that overshoots makes it fail.",
        ),
        (
            Feasibility,
            "state bounds",
            "The re-simulated states must be within their bounds everywhere, between the nodes too.",
        ),
        (
            Feasibility,
            " along ",
            "A path constraint must hold along the re-simulated flight, between the nodes too.",
        ),
        (
            Optimality,
            "gain of the objective as",
            "The objective must not improve as a quantity grows that nothing bounds: there is no optimum then, and a bound or a cost of the \
             quantity makes one.",
        ),
        (
            Optimality,
            "worth of what is missed",
            "What the trajectory misses of its constraints and equations of motion, times their multipliers, must be little beside the objective: \
             by so much it is better than what meets them exactly. It fails where a constraint can only just be met; state it so that its slope does \
             not vanish there.",
        ),
        (
            Optimality,
            "costate equation",
            "The costates must solve their differential equation, with jumps only where constraints allow; a mesh too coarse for them \
             makes it fail.",
        ),
        (
            Optimality,
            "least Hamiltonian",
            "No admissible control may have a smaller Hamiltonian at the same state and costate (Pontryagin's minimum principle); where \
             one has, the trajectory can be improved with it. At up to 24 times of each phase this is proved by branch and bound on the \
             formulas, and searched at the others; where it was searched alone, the check says so.",
        ),
        (
            Optimality,
            "mean Hamiltonian above that of another constant",
            "Among constant controls no other value over an interval may have a smaller mean of the Hamiltonian, however far it is; where one \
             has, the trajectory can be improved with it.",
        ),
        (
            Optimality,
            "mean stationarity of the Hamiltonian",
            "Among constant controls the mean of the Hamiltonian over each interval must be stationary in each control, or push it \
             against its bound.",
        ),
        (
            Optimality,
            "stationarity of the Hamiltonian",
            "The Hamiltonian must be stationary in each control, or push it against its bound.",
        ),
        (
            Optimality,
            "stationarity in the static parameters",
            "The objective must be stationary in each static parameter, or push it against its bound.",
        ),
        (
            Optimality,
            "Hamiltonian across contacts",
            "The Hamiltonian may jump at a touch point only by what the explicit time of the constraint makes.",
        ),
        (
            Optimality,
            "Hamiltonian ",
            "The Hamiltonian may change along the phase only by its explicit time; a corner at the wrong place makes it jump.",
        ),
        (
            Optimality,
            "rates of the path constraints at contacts",
            "A constraint that touches its bound has an extremum there.",
        ),
        (
            Optimality,
            "signs of the path multipliers",
            "A path constraint may push only at its bound and only inwards.",
        ),
        (
            Optimality,
            "signs of the endpoint constraint multipliers",
            "An endpoint constraint may push only at its bound and only inwards.",
        ),
        (
            Optimality,
            "signs of the multipliers of integrals",
            "A bound on an integral may push only where it is met and only inwards.",
        ),
        (
            Optimality,
            "transversality",
            "What is free at the ends must be stationary: the costates of free states, and the Hamiltonian of free times, are those of \
             the cost and the constraints there.",
        ),
        (
            Curvature,
            "negative curvature",
            "No admissible change may lower the objective to second order; beyond a conjugate point, at a saddle or at a maximum one does.",
        ),
        (
            Curvature,
            "jump of the functions beside the flight",
            "Where the flight rests at a value at which a rate or an integrand jumps, neither side may be better than the rest.",
        ),
        (
            Curvature,
            "ridges of functions of the ends",
            "Where a magnitude, a sign, a least or a largest value at the ends has its kink or its jump, no side of it may be better than the \
             point.",
        ),
        (
            Strictness,
            "second variation positive",
            "Every admissible change raises the objective to second order, so that no trajectory near this one is as good.",
        ),
        (Convexity, "convex problem", "In a convex problem an extremal is a global optimum."),
    ]
};

impl Check {
    /// One sentence that says what the check means and what makes it fail; none for a check of a mission's own.
    #[must_use]
    pub fn meaning(&self) -> Option<&'static str> {
        let fits =
            |(kind, part, _): &&(CheckKind, &str, &str)| *kind == self.kind && self.name.contains(part);
        SENTENCES.iter().find(fits).map(|(.., sentence)| *sentence)
    }
}
