use apsides::radau::Radau;
use apsides_problems::GALLERY;
use apsides_tests::perturbation::perturb;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let problem = GALLERY.iter().find(|p| p.name == a[1]).unwrap();
    let mut posed = problem.pose().unwrap();
    perturb(&mut posed.ocp, a[2].parse().unwrap());
    let s = Radau::default().solve(&posed.ocp, &posed.guess).unwrap();
    for m in &s.meshes {
        println!(
            "{:3} {:4} err {:.2e} obj {:.10} it {} fact {} rest {}",
            m.intervals,
            m.points,
            m.error,
            m.objective,
            m.counters.iterations,
            m.counters.factorisations,
            m.restorations
        );
    }
    println!("{:?} acc {} {:?}", s.status, s.accurate, s.warnings);
}
