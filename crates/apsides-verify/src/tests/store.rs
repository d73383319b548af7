//! A store between bounds that is filled and emptied at a price: along its bounds the costate is one of many.

use super::parts::{phase, trajectory};
use super::{certify, failed};
use crate::Verdict;
use apsides_ad::{Dynamics, PathFunction, Scalar};
use apsides_ocp::{Bounds, Ocp, Phase, State, Trajectory, Variable};

/// Points of each interval.
const POINTS: usize = 4;
/// Round-off of sums.
const LAST_BITS: f64 = 1e-12;

/// `x' = 0.8 fill - empty`.
struct Store;
impl Dynamics<1, 2> for Store {
    fn rate<S: Scalar>(&self, _t: S, _x: &[S; 1], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [u[0] * 0.8 - u[1]]
    }
}

/// The purchases less the sales, at a price that is linear in time.
struct Cost {
    start: f64,
    rate: f64,
}
impl PathFunction<1, 2, 1> for Cost {
    fn evaluate<S: Scalar>(&self, t: S, _x: &[S; 1], u: &[S; 2], _p: &[S; 0]) -> [S; 1] {
        [(t * self.rate + self.start) * (u[0] - u[1])]
    }
}

/// From half full to two fifths over a time of two.
fn store(price: Cost) -> Ocp {
    let phase = Phase::new("store", Store)
        .states([State::new("x", "-").within(0.0, 1.0).starts_at(0.5).ends_at(0.4).scaled_by(1.0)])
        .controls(["fill", "empty"].map(|name| Variable::new(name, "-").within(0.0, 1.0)))
        .integral(Variable::new("cost", "-"), price)
        .final_time(Bounds::fixed(2.0));
    Ocp::builder("store").phase(phase).minimize_integral("store", "cost").build().expect("well-posed")
}

/// Emptied from a time on, and filled at the end, with costates of nothing.
fn emptied_from(sold: f64, price: &Cost) -> Trajectory {
    let breaks = if sold > 0.0 { vec![0.0, sold, sold + 0.5, 1.5, 2.0] } else { vec![0.0, 0.5, 1.5, 2.0] };
    let last = breaks.len() - 2;
    let state = move |_: usize, t: f64| {
        vec![if t < sold { 0.5 } else { (0.5 - (t - sold)).max(0.0) } + 0.8 * (t - 1.5).max(0.0)]
    };
    let selling = last - 2;
    let control =
        move |k: usize, _: f64| vec![if k == last { 1.0 } else { 0.0 }, if k == selling { 1.0 } else { 0.0 }];
    let phase = phase("store", &breaks, POINTS, state, control, |_, _| vec![0.0]);
    let mean = |a: f64, b: f64| (price.start + price.rate * 0.5 * (a + b)) * (b - a);
    trajectory(vec![phase], mean(1.5, 2.0) - mean(sold, sold + 0.5))
}

/// The price falls: sold at once, bought as late as possible. While the store is empty the costate rises from -2.5 to -1.875 or less, between
/// `-(3 - t)/0.8` and `-(3 - t)`, so that no constant will do.
#[test]
fn costate_of_an_empty_store_is_any_that_rises_between_what_filling_and_emptying_allow() {
    let price = Cost { start: 3.0, rate: -1.0 };
    let optimum = emptied_from(0.0, &price);
    assert!((optimum.objective + 0.75).abs() < LAST_BITS);
    let certificate = certify(&store(price), &optimum);
    assert_eq!(certificate.verdict, Verdict::GlobalOptimum, "{certificate:#?}");
}

/// Costates of no use, such as the huge ones of dependent bounds, are not looked at.
#[test]
fn stated_costates_beyond_all_measure_do_not_matter() {
    let price = Cost { start: 3.0, rate: -1.0 };
    let mut optimum = emptied_from(0.0, &price);
    let costate = optimum.phases[0].costate.clone().expect("stated");
    let mut segments = costate.segments().to_vec();
    segments[1].values.fill(1e8);
    optimum.phases[0].costate =
        apsides_ocp::PiecewisePolynomial::new(1, costate.breaks().to_vec(), segments).ok();
    let certificate = certify(&store(price), &optimum);
    assert_eq!(certificate.verdict, Verdict::GlobalOptimum, "{certificate:#?}");
}

/// Sold later than at once, at a lower price.
#[test]
fn store_that_is_emptied_late_has_no_costate() {
    let price = Cost { start: 3.0, rate: -1.0 };
    let late = emptied_from(0.25, &price);
    let certificate = certify(&store(price), &late);
    assert_eq!(certificate.verdict, Verdict::Feasible, "{certificate:#?}");
    assert!(failed(&certificate).iter().any(|name| name.contains("Hamiltonian")), "{certificate:#?}");
}

/// The price rises: the costate of an empty store would have to fall, against its bound.
#[test]
fn store_that_is_emptied_at_a_rising_price_has_no_costate() {
    let price = Cost { start: 1.0, rate: 1.0 };
    let early = emptied_from(0.0, &price);
    let certificate = certify(&store(price), &early);
    assert_eq!(certificate.verdict, Verdict::Feasible, "{certificate:#?}");
}
