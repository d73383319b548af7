//! A small check that markup is well-formed XML: tags nest, attributes are quoted and distinct, text is escaped.

/// The contents of every svg element, with its tags.
pub(crate) fn svg_elements(page: &str) -> Vec<&str> {
    page.split("<svg")
        .skip(1)
        .map(|rest| {
            let end = rest.find("</svg>").expect("closed") + "</svg>".len();
            let start = rest.as_ptr() as usize - page.as_ptr() as usize - "<svg".len();
            &page[start..start + "<svg".len() + end]
        })
        .collect()
}

/// The body of a page, which uses no void elements.
pub(crate) fn body(page: &str) -> String {
    let start = page.find("<body>").expect("a body");
    page[start..].trim_end().trim_end_matches("</html>").trim_end().to_owned()
}

/// The first violation found.
pub(crate) fn check(markup: &str) -> Result<(), String> {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = markup;
    let mut roots = 0;
    while let Some(start) = rest.find('<') {
        text(&rest[..start])?;
        let end = tag_end(&rest[start..]).ok_or_else(|| format!("unclosed tag: {}", &rest[start..]))? + start;
        let tag = &rest[start + 1..end];
        rest = &rest[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            match open.pop() {
                Some(top) if top == name => {}
                top => return Err(format!("</{name}> closes {top:?}")),
            }
            continue;
        }
        roots += usize::from(open.is_empty());
        let (tag, alone) = tag.strip_suffix('/').map_or((tag, false), |t| (t, true));
        let (name, attributes) = tag.split_once(char::is_whitespace).unwrap_or((tag, ""));
        if name.is_empty() || !name.bytes().all(|b| b.is_ascii_alphanumeric()) {
            return Err(format!("bad name {name:?}"));
        }
        check_attributes(attributes)?;
        if !alone {
            open.push(name);
        }
    }
    text(rest)?;
    match (open.is_empty(), roots) {
        (true, 1) => Ok(()),
        (true, n) => Err(format!("{n} roots")),
        (false, _) => Err(format!("left open: {open:?}")),
    }
}

fn tag_end(text: &str) -> Option<usize> {
    let mut quoted = false;
    text.char_indices().find_map(|(k, c)| {
        quoted ^= c == '"';
        (c == '>' && !quoted).then_some(k)
    })
}

fn check_attributes(attributes: &str) -> Result<(), String> {
    let mut rest = attributes.trim();
    let mut names = Vec::new();
    while !rest.is_empty() {
        let (name, after) = rest.split_once("=\"").ok_or_else(|| format!("bad attribute {rest:?}"))?;
        let (value, after) = after.split_once('"').ok_or_else(|| format!("unquoted {rest:?}"))?;
        if names.contains(&name) || name.contains(char::is_whitespace) {
            return Err(format!("bad or repeated attribute {name:?}"));
        }
        if value.contains('<') {
            return Err(format!("`<` in attribute {name}"));
        }
        text(value)?;
        names.push(name);
        rest = after.trim_start();
    }
    Ok(())
}

fn text(text: &str) -> Result<(), String> {
    for part in text.split('&').skip(1) {
        let entity = part.split(';').next().unwrap_or_default();
        if !part.contains(';') || !matches!(entity, "lt" | "gt" | "amp" | "quot" | "apos" | "#39") {
            return Err(format!("bare & before {part:?}"));
        }
    }
    match text.chars().find(|c| c.is_control() && !matches!(c, '\n' | '\t')) {
        Some(c) => Err(format!("control character {c:?}")),
        None => Ok(()),
    }
}

#[test]
fn the_check_finds_violations() {
    assert_eq!(check("<a b=\"1\"><c/>x &amp; y</a>"), Ok(()));
    for bad in
        ["<a>", "<a></b>", "<a b=1/>", "<a b=\"1\" b=\"2\"/>", "<a>&</a>", "<a/><b/>", "<a>\u{1}</a>", "<"]
    {
        assert!(check(bad).is_err(), "{bad}");
    }
}
