//! The style of the charts as attributes of each element, for programs that draw SVG without style sheets.

use std::collections::BTreeMap;

/// Rules of the style in their order: element or classes, and declarations.
pub(super) struct InlineStyle {
    rules: Vec<(&'static str, Vec<(&'static str, &'static str)>)>,
    variables: BTreeMap<&'static str, &'static str>,
}

/// Declarations that are no attributes of SVG.
const NO_ATTRIBUTES: [&str; 2] = ["font-variant-numeric", "font"];

impl InlineStyle {
    /// Reads a style sheet of the form that the charts' has: every selector is `.chart`, alone or before an element or
    /// classes, and what is meant for other surroundings comes last.
    pub(super) fn of_sheet(sheet: &'static str) -> Self {
        let light = sheet.split("@media").next().unwrap_or(sheet);
        let mut looks = Self { rules: Vec::new(), variables: BTreeMap::new() };
        for rule in light.split('}') {
            let Some((selectors, declarations)) = rule.split_once('{') else { continue };
            let declarations: Vec<_> =
                declarations.split(';').filter_map(|one| one.split_once(':')).collect();
            let variables = declarations.iter().filter(|(name, _)| name.starts_with("--"));
            looks.variables.extend(variables.copied());
            for selector in selectors.split(',') {
                let part = selector.trim().trim_start_matches(".chart").trim();
                looks.rules.push((part, declarations.clone()));
            }
        }
        looks
    }

    /// Style of an element of these classes.
    pub(super) fn of(&self, element: &str, classes: &str) -> Vec<(&'static str, String)> {
        let is_meant = |part: &str| match part.strip_prefix('.') {
            Some(names) => names.split('.').all(|name| classes.split(' ').any(|class| class == name)),
            None => part == element || (part.is_empty() && classes.split(' ').any(|class| class == "chart")),
        };
        let mut found = BTreeMap::new();
        for (name, value) in self.rules.iter().filter(|(part, _)| is_meant(part)).flat_map(|(_, all)| all) {
            if *name == "font"
                && let Some((size, family)) = value.split_once(' ')
            {
                found.insert("font-size", size.to_owned());
                found.insert("font-family", family.replace('"', "'"));
            } else if !name.starts_with("--") && !NO_ATTRIBUTES.contains(name) {
                found.insert(*name, self.value(value).to_owned());
            }
        }
        found.into_iter().collect()
    }

    fn value(&self, value: &'static str) -> &'static str {
        let variable = value.strip_prefix("var(").and_then(|name| name.strip_suffix(')'));
        variable.and_then(|name| self.variables.get(name).copied()).unwrap_or(value)
    }
}
