//! The text of a file with other values.

use toml_edit::{DocumentMut, Item, Table, value};

use crate::file::ProblemFile;

/// A value that is written.
#[derive(Clone, Debug, PartialEq)]
pub enum Written<'a> {
    /// A number.
    Number(f64),
    /// A whole number.
    Count(i64),
    /// A word.
    Word(&'a str),
    /// True or false.
    Flag(bool),
}

impl Written<'_> {
    fn item(&self) -> Item {
        match self {
            Self::Number(v) => value(*v),
            Self::Count(v) => value(*v),
            Self::Word(v) => value(*v),
            Self::Flag(v) => value(*v),
        }
    }
}

impl ProblemFile {
    /// The text of the file with the values of its constants, in their units, and of other keys by their paths. Comments and order stay;
    /// tables of CSV files are written into the text, so that it stands alone.
    pub fn written<'a>(
        &self,
        constants: &[f64],
        others: impl IntoIterator<Item = (&'a str, Written<'a>)>,
    ) -> String {
        // The text was read before.
        let Ok(mut document) = self.text().parse::<DocumentMut>() else { return self.text().to_owned() };
        for (constant, number) in self.statement().constants().iter().zip(constants) {
            if constant.value == *number {
                continue;
            }
            let item = &mut document["constants"][constant.name.as_str()];
            let with_unit = |unit: &str| value(format!("{number:?} {unit}"));
            let is_text = item.is_str();
            match item.as_table_like_mut() {
                Some(table) => {
                    let is_text = table.get("value").is_some_and(Item::is_str);
                    let written =
                        if is_text { with_unit(&constant.unit.to_string()) } else { value(*number) };
                    set(table.entry("value").or_insert(Item::None), written);
                }
                None if is_text => set(item, with_unit(&constant.unit.to_string())),
                None => set(item, value(*number)),
            }
        }
        for (name, text) in self.csv_tables() {
            set(&mut document["tables"][name]["csv"], value(text));
        }
        for (path, written) in others {
            match path.split_once('.') {
                None => set(&mut document[path], written.item()),
                Some((table, key)) => {
                    let table = document.entry(table).or_insert_with(|| Item::Table(Table::new()));
                    set(&mut table[key], written.item());
                }
            }
        }
        document.to_string()
    }
}

/// Replaces a value and keeps the comment beside it.
fn set(item: &mut Item, new: Item) {
    let decor = item.as_value().map(|v| v.decor().clone());
    *item = new;
    if let (Some(decor), Some(value)) = (decor, item.as_value_mut()) {
        *value.decor_mut() = decor;
    }
}
