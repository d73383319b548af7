//! The speed that leaves the Moon from 15 km, in km/s: a formula with units, and one whose units do not go together.
//!
//! With mu = 4902.8 km3/s2 and a radius of 1737.4 km it is sqrt(2 mu / r) = 2.3655 km/s.
#![allow(clippy::print_stdout)]

use apsides_expressions::{Compiler, Definition, Expression, Library, Numbers, Unit};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let define = |name: &str, text: &str, number| {
        let body = Expression::parse(text, number)?;
        Ok::<_, apsides_expressions::ExpressionError>(Definition {
            name: name.into(),
            arguments: Vec::new(),
            body,
            dimension: None,
        })
    };
    let library = Library {
        definitions: vec![define("mu", "4902.8 [km3/s2]", 0)?, define("radius", "1737.4 [km]", 1)?],
        tables: Vec::new(),
    };
    let mut compiler = Compiler::new(Numbers, &library, true);
    let unit = Unit::parse("km/s")?;
    let text = "sqrt(2*mu/(radius + 15 [km]))";
    let speed = compiler.compile(&Expression::parse(text, 2)?, Some(unit.dimension), "the speed")?;
    let speed = speed.number().unwrap_or(f64::NAN) / unit.factor;
    println!("{text} = {speed:.4} {unit}");
    assert!((speed - 2.3655).abs() < 5e-5);

    let refused = Expression::parse("sqrt(2*mu/(radius + 15))", 3)
        .and_then(|f| compiler.compile(&f, None, "the speed"));
    let Err(refused) = refused else { return Err("a length and a number have a sum".into()) };
    println!("{refused}, at {:?}", refused.at().bytes);
    assert_eq!(refused.at().bytes, 10..23);
    Ok(())
}
