//! The file of a problem that a program states: the same quantities in the same units, which formulas are not checked for.

use std::fmt::Write;

use apsides_expressions::text::TextWriter;
use apsides_expressions::{Expression, Unit};

use crate::model::{
    Amount, Bounded, End, Guess, Link, Model, MotionAxes, Objective, Phase, Profile, Row, Shape, Stated,
    StatedMotion, TableData, Variable,
};
use crate::statement::Statement;

impl Statement {
    /// The text of a file with this problem. What formulas have in common becomes definitions.
    #[must_use]
    pub fn exported(&self) -> String {
        Exporter::new(&self.model).file(&self.model, self.name(), self.title())
    }
}

struct Exporter<'a> {
    formulas: TextWriter,
    tables: &'a [TableData],
}

impl<'a> Exporter<'a> {
    fn new(model: &'a Model) -> Self {
        let taken = |prefix: &str| {
            let all = model.phases.iter().flat_map(|p| p.states.iter().chain(&p.controls));
            let all = all.chain(&model.parameters).map(|v| &v.name);
            all.chain(model.constants.iter().map(|c| &c.name)).any(|n| n.starts_with(prefix))
        };
        let mut prefix = "part_".to_owned();
        while taken(&prefix) {
            prefix.push('_');
        }
        Self { formulas: TextWriter::new(&prefix), tables: &model.tables }
    }

    fn file(&mut self, model: &Model, name: &str, title: &str) -> String {
        // Formulas first, since they say which definitions there are.
        let mut body = String::new();
        for phase in &model.phases {
            self.phase(&mut body, phase);
        }
        for link in &model.links {
            self.link(&mut body, link);
        }
        if !model.boundary.is_empty() {
            body += "\n[boundary]\n";
            for row in &model.boundary {
                line(&mut body, &row.name, &self.row(row));
            }
        }
        if let Some(objective) = &model.objective {
            self.objective(&mut body, objective);
        }
        for guess in &model.guess {
            self.guess(&mut body, guess, model);
        }
        if let Some(motion) = &model.motion {
            self.motion(&mut body, motion);
        }
        let mut parameters = String::new();
        for parameter in &model.parameters {
            line(&mut parameters, &parameter.name, &self.variable(parameter));
        }
        let mut file = "kind = \"problem\"\n".to_owned();
        line(&mut file, "name", &quoted(name));
        line(&mut file, "title", &quoted(title));
        if model.has_units && !model.checks_units {
            line(&mut file, "check_units", "false");
        }
        if !model.constants.is_empty() {
            file += "\n[constants]\n";
            for c in &model.constants {
                let [least, most] = c.range;
                let mut items = vec![format!("value = {:?}", c.value)];
                items.extend(unit_item(&c.unit));
                items.extend(least.is_finite().then(|| format!("min = {least:?}")));
                items.extend(most.is_finite().then(|| format!("max = {most:?}")));
                items.extend((!c.meaning.is_empty()).then(|| format!("meaning = {}", quoted(&c.meaning))));
                line(&mut file, &c.name, &braces(&items));
            }
        }
        if !self.formulas.definitions.is_empty() {
            file += "\n[definitions]\n";
            for (name, text) in &self.formulas.definitions {
                line(&mut file, name, &quoted(text));
            }
        }
        for (k, table) in self.tables.iter().enumerate() {
            // Writing to a string does not fail.
            let _ = writeln!(file, "\n[tables.{}]", table_name(k));
            line(&mut file, "x", &list(&table.x));
            if table.y.is_empty() {
                line(&mut file, "values", &list(&table.values));
            } else {
                line(&mut file, "y", &list(&table.y));
                let rows: Vec<String> = table.values.chunks(table.y.len()).map(list).collect();
                line(&mut file, "values", &format!("[{}]", rows.join(", ")));
            }
            if table.shape == Shape::Monotone {
                line(&mut file, "shape", &quoted("monotone"));
            }
        }
        if !parameters.is_empty() {
            file += "\n[parameters]\n";
            file += &parameters;
        }
        file + &body
    }

    fn formula(&mut self, formula: &Expression) -> String {
        let tables = self.tables;
        let renamed = |name: &str| match tables.iter().position(|t| t.name == name) {
            Some(k) => table_name(k),
            None => name.to_owned(),
        };
        self.formulas.text(formula, &renamed)
    }

    fn stated(&mut self, stated: &Stated) -> String {
        match &stated.amount {
            Amount::Number(number) => format!("{number:?}"),
            Amount::Formula(formula) => quoted(&self.formula(formula)),
        }
    }

    fn end(&mut self, end: &End) -> String {
        match end {
            End::Free => quoted("free"),
            End::Fixed(stated) => self.stated(stated),
            End::Between(least, most) => {
                format!("[{}, {}]", self.stated(least), self.stated(most))
            }
        }
    }

    fn variable(&mut self, v: &Variable) -> String {
        let mut items: Vec<String> = unit_item(&v.unit).into_iter().collect();
        let amounts = [
            ("min", &v.least),
            ("max", &v.most),
            ("scale", &v.scale),
            ("tolerance", &v.tolerance),
            ("guess", &v.guess),
        ];
        for (key, stated) in amounts {
            items.extend(stated.as_ref().map(|s| format!("{key} = {}", self.stated(s))));
        }
        for (key, end) in [("start", &v.start), ("end", &v.end)] {
            items.extend(end.as_ref().map(|e| format!("{key} = {}", self.end(e))));
        }
        items.extend(guard(v.guards));
        braces(&items)
    }

    fn row(&mut self, row: &Row) -> String {
        let mut items: Vec<String> = row.unit.as_ref().and_then(unit_item).into_iter().collect();
        match &row.formula {
            Bounded::Relation(relation) => {
                let sides: Vec<String> = relation.sides.iter().map(|s| self.formula(s)).collect();
                let mut text = sides.first().cloned().unwrap_or_default();
                for (comparison, side) in relation.comparisons.iter().zip(&sides[1..]) {
                    let _ = write!(text, " {} {side}", comparison.symbol());
                }
                return quoted(&text);
            }
            Bounded::Keys { value, least, most } => {
                items.push(format!("value = {}", quoted(&self.formula(value))));
                for (key, stated) in [("min", least), ("max", most), ("scale", &row.scale)] {
                    items.extend(stated.as_ref().map(|s| format!("{key} = {}", self.stated(s))));
                }
            }
        }
        items.extend(guard(row.guards));
        braces(&items)
    }

    fn phase(&mut self, out: &mut String, phase: &Phase) {
        let _ = writeln!(out, "\n[phase.{}]", phase.name);
        if let Some(times) = &phase.times {
            let ends = [("start", &times.start), ("end", &times.end), ("duration", &times.duration)];
            let stated = ends.into_iter().filter_map(|(key, end)| Some((key, end.as_ref()?)));
            let mut items: Vec<String> =
                stated.map(|(key, end)| format!("{key} = {}", self.end(end))).collect();
            items.extend(times.unit.as_ref().and_then(unit_item));
            line(out, "time", &braces(&items));
        }
        for state in &phase.states {
            line(out, &format!("states.{}", state.name), &self.variable(state));
        }
        for control in &phase.controls {
            line(out, &format!("controls.{}", control.name), &self.variable(control));
        }
        for (state, _, rate) in &phase.dynamics {
            line(out, &format!("dynamics.{state}"), &quoted(&self.formula(rate)));
        }
        for row in &phase.path {
            line(out, &format!("path.{}", row.name), &self.row(row));
        }
        for row in &phase.integrals {
            line(out, &format!("integrals.{}", row.name), &self.row(row));
        }
        for (state, _, values) in &phase.kinks {
            let values: Vec<String> = values.iter().map(|v| self.stated(v)).collect();
            line(out, &format!("kinks.{state}"), &format!("[{}]", values.join(", ")));
        }
        if !phase.directions.is_empty() {
            let names =
                |angles: &Vec<String>| angles.iter().map(|a| quoted(a)).collect::<Vec<_>>().join(", ");
            let all: Vec<String> =
                phase.directions.iter().map(|(angles, _)| format!("[{}]", names(angles))).collect();
            line(out, "directions", &format!("[{}]", all.join(", ")));
        }
    }

    fn link(&mut self, out: &mut String, link: &Link) {
        let mut items = vec![format!("to = {}", quoted(&link.to))];
        let jumps = link.jumps.iter().map(|(name, _, by)| format!("{name} = {}", self.stated(by)));
        let jumps: Vec<String> = jumps.collect();
        items.extend((!jumps.is_empty()).then(|| format!("jump = {}", braces(&jumps))));
        let free: Vec<String> = link.free.iter().map(|(name, _)| quoted(name)).collect();
        items.extend((!free.is_empty()).then(|| format!("free = [{}]", free.join(", "))));
        // Each phase may be linked to several.
        let heading = format!("[[links.{}]]", link.from);
        let _ = writeln!(out, "\n{heading}\n{}", items.join("\n"));
    }

    fn objective(&mut self, out: &mut String, objective: &Objective) {
        let _ = writeln!(out, "\n[objective]");
        let key = if objective.maximize { "maximize" } else { "minimize" };
        line(out, key, &quoted(&self.formula(&objective.formula)));
        if let Some(name) = &objective.name {
            line(out, "name", &quoted(name));
        }
        if let Some(unit) = objective.unit.as_ref().filter(|u| **u != Unit::none()) {
            line(out, "unit", &quoted(&unit.to_string()));
        }
        if let Some(scale) = &objective.scale {
            let scale = self.stated(scale);
            line(out, "scale", &scale);
        }
    }

    fn motion(&mut self, out: &mut String, motion: &StatedMotion) {
        let _ = writeln!(out, "\n[motion]");
        line(out, "body", &quoted(&motion.body));
        if let Some((word, _)) = MotionAxes::WORDS.iter().find(|(_, axes)| *axes == motion.axes) {
            line(out, "axes", &quoted(word));
        }
        if let Some(site) = &motion.site {
            let parts = [
                ("longitude", Some(&site.longitude)),
                ("latitude", Some(&site.latitude)),
                ("altitude", site.altitude.as_ref()),
            ];
            let parts = parts.into_iter().filter_map(|(key, part)| Some((key, part?)));
            let items: Vec<String> =
                parts.map(|(key, part)| format!("{key} = {}", self.stated(part))).collect();
            line(out, "site", &braces(&items));
        }
        for (key, parts) in motion.named_parts() {
            for part in parts {
                let key =
                    part.phase.as_ref().map_or_else(|| key.to_owned(), |phase| format!("{key}.{phase}"));
                let formulas: Vec<String> =
                    part.components.iter().map(|f| quoted(&self.formula(f))).collect();
                let value = match &formulas[..] {
                    [only] => only.clone(),
                    _ => format!("[{}]", formulas.join(", ")),
                };
                line(out, &key, &value);
            }
        }
    }

    fn guess(&mut self, out: &mut String, guess: &Guess, model: &Model) {
        let named = guess.phase.as_ref();
        let phase = model.phases.iter().find(|p| named.is_none_or(|n| *n == p.name));
        let _ = match phase {
            Some(phase) => writeln!(out, "\n[guess.{}]", phase.name),
            None => writeln!(out, "\n[guess]"),
        };
        let list = |of: &mut Self, values: &[Stated]| {
            let values: Vec<String> = values.iter().map(|v| of.stated(v)).collect();
            format!("[{}]", values.join(", "))
        };
        if let Some(times) = &guess.times {
            line(out, "time", &list(self, times));
        }
        for (name, _, profile) in &guess.profiles {
            let text = match profile {
                Profile::Samples(values) => list(self, values),
                Profile::Formula(formula) => quoted(&self.formula(formula)),
            };
            line(out, name, &text);
        }
    }
}

fn table_name(index: usize) -> String {
    format!("table_{}", index + 1)
}

/// None where there is no unit.
fn unit_item(unit: &Unit) -> Option<String> {
    (*unit != Unit::none()).then(|| format!("unit = {}", quoted(&unit.to_string())))
}

fn guard(guards: [bool; 2]) -> Option<String> {
    let word = match guards {
        [false, false] => return None,
        [true, true] => "true",
        [true, false] => "\"min\"",
        [false, true] => "\"max\"",
    };
    Some(format!("guard = {word}"))
}

fn line(out: &mut String, key: &str, value: &str) {
    // Writing to a string does not fail.
    let _ = writeln!(out, "{key} = {value}");
}

fn braces(items: &[String]) -> String {
    if items.is_empty() { "{}".into() } else { format!("{{ {} }}", items.join(", ")) }
}

fn list(numbers: &[f64]) -> String {
    format!("[{}]", numbers.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", "))
}

/// A text as TOML has it.
fn quoted(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}
