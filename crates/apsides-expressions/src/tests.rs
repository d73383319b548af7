use super::*;
use crate::function::{Binary, Unary};

/// Round-off of the arithmetic.
const ROUNDING: f64 = 1e-14;

/// Evaluates while it records: the oracle of the operations.
#[derive(Default)]
struct Tape(Vec<f64>);

impl Tape {
    fn push(&mut self, x: f64) -> usize {
        self.0.push(x);
        self.0.len() - 1
    }
}

impl Recorder for Tape {
    type Value = usize;
    fn constant(&mut self, number: f64) -> usize {
        self.push(number)
    }
    fn unary(&mut self, f: Unary, x: usize) -> usize {
        self.push(f.at(self.0[x]))
    }
    fn binary(&mut self, f: Binary, x: usize, y: usize) -> usize {
        self.push(f.at(self.0[x], self.0[y]))
    }
    fn power(&mut self, x: usize, exponent: f64) -> usize {
        self.push(Binary::Power.at(self.0[x], exponent))
    }
    fn select(&mut self, c: Comparison, a: usize, b: usize, then: usize, otherwise: usize) -> usize {
        let (a, b) = (self.0[a], self.0[b]);
        let holds = match c {
            Comparison::Less => a < b,
            Comparison::AtMost => a <= b,
            Comparison::Greater => a > b,
            Comparison::AtLeast => a >= b,
            Comparison::Equal => a == b,
        };
        self.push(self.0[if holds { then } else { otherwise }])
    }
    fn table(&mut self, index: usize, at: &[usize]) -> usize {
        self.push(at.iter().map(|k| self.0[*k]).sum::<f64>() + index as f64)
    }
}

fn library() -> Library {
    let define = |heading_text: &str, body: &str, unit: Option<&str>| {
        let (name, arguments) = heading(heading_text, 9).unwrap();
        let dimension = unit.map(|u| Unit::parse(u).unwrap().dimension);
        Definition { name, arguments, body: Expression::parse(body, 1).unwrap(), dimension }
    };
    Library {
        definitions: vec![
            define("density(h)", "1.225 [kg/m3] * exp(-h/scale_height)", Some("kg/m3")),
            define("scale_height", "7.2 [km]", None),
            define("pressure", "0.5*density(h)*v^2", Some("Pa")),
            define("circle", "square + 1", None),
            define("square", "circle^2", None),
        ],
        tables: vec![Table {
            name: "thrust".into(),
            variables: vec![Dimension::NONE],
            dimension: Dimension::LENGTH,
        }],
    }
}

/// Height 1000 m, speed 200 m/s, angle 0.5, n = 3.
fn compiler(library: &Library) -> Compiler<'_, Tape> {
    let mut tape = Tape::default();
    let [h, v, angle, n] = [1000.0, 200.0, 0.5, 3.0].map(|x| tape.push(x));
    let mut compiler = Compiler::new(tape, library, true);
    let speed = Dimension::LENGTH / Dimension::TIME;
    let quantities = [
        ("h", h, Dimension::LENGTH),
        ("v", v, speed),
        ("angle", angle, Dimension::NONE),
        ("n", n, Dimension::NONE),
    ];
    for (name, value, dimension) in quantities {
        compiler.name(name, Quantity::new(Value::Recorded(value), dimension));
    }
    compiler.refuse("u", "`u` is a control, which has no value at an end");
    compiler
}

fn evaluate(text: &str) -> Result<(f64, String), ExpressionError> {
    let library = library();
    let mut compiler = compiler(&library);
    let found = compiler.compile(&Expression::parse(text, 0)?, None, "it")?;
    let value = match found.value {
        Value::Number(number) => number,
        Value::Recorded(k) => compiler.recorder().0[k],
    };
    Ok((value, found.dimension.to_string()))
}

#[test]
fn formulas_have_values_and_units() {
    let pressure = 0.5 * 1.225 * (-1000.0_f64 / 7200.0).exp() * 200.0 * 200.0;
    let cases: [(&str, f64, &str); 24] = [
        ("1 + 2*3 - 4/2", 5.0, "1"),
        ("-2^2", -4.0, "1"),
        ("2^-1", 0.5, "1"),
        ("2^3^2", 512.0, "1"),
        ("2**3", 8.0, "1"),
        ("-n*-n", 9.0, "1"),
        ("8 - 3 - 2", 3.0, "1"),
        ("8/4/2", 1.0, "1"),
        ("(1 + n)*2", 8.0, "1"),
        ("v^2/h", 40.0, "m/s2"),
        ("sqrt(h^2 + (3 [km])^2)", (1e6_f64 + 9e6).sqrt(), "m"),
        ("hypot(h, 3 [km])", (1e6_f64 + 9e6).sqrt(), "m"),
        ("pressure", pressure, "kg/(m s2)"),
        ("density(0)", 1.225, "kg/m3"),
        ("sin(30 [deg])", 0.5, "1"),
        ("min(h, 2 [km], 0.5 [km])", 500.0, "m"),
        ("max(0, -h)", 0.0, "m"),
        ("clamp(n, 0, 2)", 2.0, "1"),
        ("if(h < 2 [km], v, 0)", 200.0, "m/s"),
        ("if(1 >= 2, 3, 4)", 4.0, "1"),
        ("n^angle", 3.0_f64.sqrt(), "1"),
        ("atan2(v, v)", std::f64::consts::FRAC_PI_4, "1"),
        ("thrust(n)", 3.0, "m"),
        ("1.5e1 + 1_000 + .5", 1015.5, "1"),
    ];
    for (text, value, unit) in cases {
        let found = evaluate(text).unwrap_or_else(|e| panic!("{text}: {e}"));
        assert!((found.0 - value).abs() <= ROUNDING * value.abs(), "{text}: {} instead of {value}", found.0);
        assert_eq!(found.1, unit, "{text}");
    }
}

#[test]
fn mistakes_have_a_sentence_and_a_place() {
    let cases = [
        ("h + v", "`+` takes quantities of one unit, these are m and m/s", 0..5),
        ("1 + sin(h)", "the argument of `sin` is a number or an angle, this is m", 4..10),
        ("h^v", "an exponent is a number or an angle, this is m/s", 0..3),
        ("h^n", "what is raised to a power that is not constant is a number or an angle, this is m", 0..3),
        ("2 h", "expected an operator such as `*` or the end of the formula, found `h`", 2..3),
        ("(1 + 2", "expected an operator, `,` or `)`, found the end", 6..6),
        ("", "expected a number, a name or `(`, found nothing", 0..0),
        ("1 +", "expected a number, a name or `(`, found the end", 3..3),
        ("a = 3", "expected `==` for equal, found `=`", 2..3),
        ("angl*2", "no quantity is named `angl`; the nearest is `angle`", 0..4),
        ("densty(h)", "no function is named `densty`; the nearest is `density`", 0..9),
        ("density(h, v)", "`density` takes 1 argument, found 2", 0..13),
        ("sin()", "`sin` takes 1 argument, found 0", 0..5),
        ("atan2(n)", "`atan2` takes 2 arguments, found 1", 0..8),
        ("v(2)", "`v` is a quantity, no function", 0..4),
        ("thrust", "`thrust` is a function: give it arguments", 0..6),
        ("sin", "`sin` is a function: give it arguments", 0..3),
        ("3 [kms]", "no unit is named `kms`; the nearest is `km`", 3..6),
        ("3 [km", "expected a unit in brackets", 2..3),
        ("u*2", "`u` is a control, which has no value at an end", 0..1),
        ("circle", "the definition `circle` needs itself: `circle` -> `square` -> `circle`", 0..6),
        ("1/0", "divide of 1 and 0 is inf, no finite number", 0..3),
        ("h/0", "a division by 0 is inf, no finite number", 0..3),
        ("ln(-1)", "ln of -1 is NaN", 0..6),
        ("n < 3", "a comparison has no value", 0..5),
        ("if(n, 1, 2)", "the first argument of `if` is a comparison", 0..11),
        ("if(n < 3, 1 [m], 2 [s])", "`if` takes quantities of one unit, these are m and s", 0..23),
        ("if(n == 3, 1, 2)", "single points", 0..16),
        ("1e999", "expected a finite number, found `1e999`", 0..5),
        ("n ? 2", "expected a number, a name or one of", 2..3),
        ("1..2", "operator", 2..4),
    ];
    for (text, sentence, bytes) in cases {
        let error = evaluate(text).map(|found| panic!("{text}: {found:?}")).unwrap_err();
        assert!(error.to_string().contains(sentence), "{text}: {error}");
        if !matches!(error, ExpressionError::Circle { .. }) {
            assert_eq!(error.at().bytes, bytes, "{text}: {error}");
        }
    }
}

#[test]
fn a_formula_that_has_another_unit_than_wanted_is_refused() {
    let library = library();
    let mut compiler = compiler(&library);
    let formula = Expression::parse("v", 0).unwrap();
    let refused = compiler.compile(&formula, Some(Dimension::LENGTH), "the rate of `h`").unwrap_err();
    assert_eq!(refused.to_string(), "the rate of `h` has the unit m, this is m/s");
    assert!(compiler.compile(&Expression::parse("0", 0).unwrap(), Some(Dimension::LENGTH), "it").is_ok());
}

#[test]
fn long_and_deep_formulas_neither_hang_nor_overflow() {
    let long = format!("n{}", " + n*2".repeat(100_000));
    assert_eq!(evaluate(&long).unwrap().0, 3.0 + 6e5);
    assert_eq!(Expression::parse(&long, 0).unwrap().terms().len(), 100_001);
    for deep in ["(", "-", "sin(", "2^", "if(", "[", "density("] {
        let error = evaluate(&deep.repeat(100_000)).unwrap_err();
        assert!(
            matches!(error, ExpressionError::Limit { .. } | ExpressionError::Syntax { .. }),
            "{deep}: {error}"
        );
    }
    assert!(evaluate(&format!("{}n{}", "(".repeat(100), ")".repeat(100))).is_ok());
    // Definitions that double with each.
    let doubling = (0..60).map(|k| {
        let body = if k == 0 { "x + 1".into() } else { format!("f{0}(x + {k}) * f{0}(x - {k})", k - 1) };
        let body = Expression::parse(&body, k).unwrap();
        Definition { name: format!("f{k}"), arguments: vec!["x".into()], body, dimension: None }
    });
    let library = Library { definitions: doubling.collect(), tables: Vec::new() };
    let mut compiler = Compiler::new(Tape(vec![0.5]), &library, true);
    compiler.name("n", Quantity::new(Value::Recorded(0), Dimension::NONE));
    let refused = compiler.compile(&Expression::parse("f59(n)", 0).unwrap(), None, "it").unwrap_err();
    assert!(matches!(refused, ExpressionError::Limit { .. }), "{refused}");
}

#[test]
fn relations_and_terms() {
    let relation = Relation::parse("1 <= if(n < 2, n, 3) <= v", 0).unwrap();
    assert_eq!(relation.sides.len(), 3);
    assert_eq!(relation.comparisons, [Comparison::AtMost, Comparison::AtMost]);
    let sum = Expression::parse("a - (b - 2*c) + d/2", 0).unwrap().terms();
    let signs: Vec<f64> = sum.iter().map(|(sign, _)| *sign).collect();
    assert_eq!(signs, [1.0, -1.0, 1.0, 1.0]);
    assert_eq!(sum[0].1.as_name(), Some("a"));
    let (two, c, product) = sum[2].1.factors().unwrap();
    assert_eq!((two.as_name(), c.as_name(), product), (None, Some("c"), true));
}

#[test]
fn headings() {
    assert_eq!(heading("drag", 0).unwrap(), ("drag".into(), vec![]));
    assert_eq!(heading("f( a, b )", 0).unwrap(), ("f".into(), vec!["a".into(), "b".into()]));
    for wrong in ["f(", "f()", "2f", "f(a,a)", "f(a b)", ""] {
        assert!(heading(wrong, 0).is_err(), "{wrong}");
    }
}

proptest::proptest! {
    #[test]
    fn no_text_panics(text in "[-+*/^()\\[\\]<>=,.0-9a-zA-Zµé \\n]{0,60}") {
        let _ = evaluate(&text);
        let _ = Unit::parse(&text);
        let _ = heading(&text, 0);
        let _ = Relation::parse(&text, 0);
    }
}
