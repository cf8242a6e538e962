//! Undo and redo over what the user edits: model, controller, experiment, layout.

use std::path::PathBuf;

use flqr_core::effects::name_and_unit;
use flqr_core::model_file::Change;

use crate::design::Comparison;
use crate::experiments::Settings;
use crate::layout::Node;
use crate::quantity::STATES;
use crate::session::Session;

/// The oldest steps go first.
const LONGEST: usize = 200;

/// Undone step.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Content {
    pub(crate) session: Session,
    /// Which of the loaded models it was made from.
    pub(crate) base: usize,
    /// Which of the opened ledgers is shown.
    pub(crate) ledger: usize,
    pub(crate) comparison: Comparison,
    pub(crate) experiment: Settings,
    pub(crate) layout: Node,
}

impl Content {
    /// Returns whether nothing that is worth a step differs; which page is in front is not.
    fn is_alike(&self, other: &Self) -> bool {
        (self.base, self.ledger) == (other.base, other.ledger)
            && self.session == other.session
            && self.comparison == other.comparison
            && self.experiment == other.experiment
            && self.layout.is_alike(&other.layout)
    }
}

/// A loaded model as its file has it.
#[derive(Clone, Debug)]
pub(crate) struct Base {
    pub(crate) saved: Session,
    pub(crate) path: Option<PathBuf>,
}

/// A step, and what was there on its other side.
#[derive(Clone, Debug)]
struct Step {
    name: String,
    content: Content,
}

/// All steps.
pub(crate) struct Undo {
    now: Content,
    past: Vec<Step>,
    future: Vec<Step>,
    /// Name of the next step, if given by its caller.
    name: Option<String>,
    bases: Vec<Base>,
}

impl Undo {
    pub(crate) fn new(now: Content, base: Base) -> Self {
        Self {
            now: Content { base: 0, ..now },
            past: Vec::new(),
            future: Vec::new(),
            name: None,
            bases: vec![base],
        }
    }

    /// The number of a model that was just loaded.
    pub(crate) fn add_base(&mut self, base: Base) -> usize {
        self.bases.push(base);
        self.bases.len() - 1
    }

    /// A model as its file has it now.
    pub(crate) fn set_base(&mut self, number: usize, base: Base) {
        if let Some(kept) = self.bases.get_mut(number) {
            *kept = base;
        }
    }

    pub(crate) fn base(&self, number: usize) -> Option<&Base> {
        self.bases.get(number)
    }

    /// Calls the step that is being made `name`.
    pub(crate) fn call(&mut self, name: impl Into<String>) {
        self.name = Some(name.into());
    }

    /// Takes in what there is now, if that is not what there was. It becomes a step as soon as no drag is under way.
    pub(crate) fn watch(&mut self, other: Option<Content>, settled: bool) {
        let Some(present) = other else {
            self.name = None;
            return;
        };
        if !settled {
            return;
        }
        if self.now.is_alike(&present) {
            self.now = present;
            return;
        }
        let name = self.name.take().unwrap_or_else(|| describe(&self.now, &present));
        let content = std::mem::replace(&mut self.now, present);
        self.past.push(Step { name, content });
        self.future.clear();
        if self.past.len() > LONGEST {
            self.past.remove(0);
        }
    }

    /// Takes what there is now as the start, without a step.
    pub(crate) fn rebase(&mut self, now: Content) {
        self.now = now;
        self.name = None;
    }

    /// State at the last step.
    pub(crate) fn now(&self) -> &Content {
        &self.now
    }

    /// Names of the steps that can be undone, newest first.
    pub(crate) fn undoable(&self) -> impl Iterator<Item = &str> {
        self.past.iter().rev().map(|step| &*step.name)
    }

    /// Names of the steps that can be redone, next first.
    pub(crate) fn redoable(&self) -> impl Iterator<Item = &str> {
        self.future.iter().rev().map(|step| &*step.name)
    }

    /// State restored by undo or redo.
    pub(crate) fn peek(&self, redo: bool) -> Option<&Content> {
        let steps = if redo { &self.future } else { &self.past };
        steps.last().map(|step| &step.content)
    }

    /// Goes one step back, or forth; gives its name.
    pub(crate) fn go(&mut self, redo: bool) -> Option<(String, Content)> {
        let (from, to) =
            if redo { (&mut self.future, &mut self.past) } else { (&mut self.past, &mut self.future) };
        let Step { name, content } = from.pop()?;
        let before = std::mem::replace(&mut self.now, content.clone());
        to.push(Step { name: name.clone(), content: before });
        Some((name, content))
    }
}

/// A name for what lies between two contents.
fn describe(old: &Content, new: &Content) -> String {
    let changes = old.session.model().changes_to(&new.session.model());
    if !changes.is_empty() {
        return describe_model(&changes);
    }
    if old.session.controller != new.session.controller {
        return format!("controller {}", new.session.controller_name());
    }
    if old.experiment != new.experiment {
        return "experiment".to_owned();
    }
    if old.comparison != new.comparison {
        return "designs A and B".to_owned();
    }
    "layout".to_owned()
}

fn describe_model(changes: &[Change]) -> String {
    let values = |change: &Change| {
        let value = |value: &Option<String>| value.clone().unwrap_or_else(|| "none".to_owned());
        format!("{} → {}", value(&change.old), value(&change.new))
    };
    let first = &changes[0];
    let all_in = |table: &str| changes.iter().all(|change| change.key.starts_with(table));
    let alike = changes.iter().all(|change| (&change.old, &change.new) == (&first.old, &first.new));
    if changes.len() == 1 {
        format!("{} {}", words(&first.key), values(first))
    } else if all_in("lqr.r_diagonal") && alike {
        format!("torque weights {}", values(first))
    } else if all_in("lqr.") {
        "weights".to_owned()
    } else if all_in("friction.") {
        "friction".to_owned()
    } else {
        format!("{} values of the model", changes.len())
    }
}

/// A key of the model file, for people.
pub(crate) fn words(key: &str) -> String {
    const WEIGHTS: [(&str, &str); 6] = [
        ("lqr.q_diagonal[1]", "displacement weight"),
        ("lqr.q_diagonal[2]", "velocity weight"),
        ("lqr.q_diagonal[3]", "pitch weight"),
        ("lqr.q_diagonal[4]", "pitch rate weight"),
        ("lqr.r_diagonal[1]", "left torque weight"),
        ("lqr.r_diagonal[2]", "right torque weight"),
    ];
    let known = WEIGHTS.iter().find(|(known, _)| *known == key).map(|(_, words)| (*words).to_owned());
    known.or_else(|| entry_words(key)).unwrap_or_else(|| plain_words(key))
}

/// An entry of a full weight matrix, `lqr.q[1][3]`.
fn entry_words(key: &str) -> Option<String> {
    const R: &[&str] = &["left torque", "right torque"];
    let (names, place) = match key.strip_prefix("lqr.q[") {
        Some(place) => (&STATES[..], place),
        None => (R, key.strip_prefix("lqr.r[")?),
    };
    let (row, column) = place.strip_suffix(']')?.split_once("][")?;
    let name = |number: &str| names.get(number.parse::<usize>().ok()?.checked_sub(1)?);
    let (row, column) = (name(row)?, name(column)?);
    Some(if row == column { format!("{row} weight") } else { format!("{row} with {column} weight") })
}

/// A key without a separate name: its table, its words, and its unit in brackets.
fn plain_words(key: &str) -> String {
    let (table, name) = key.rsplit_once('.').unwrap_or(("", key));
    let (name, unit) = name_and_unit(name);
    let mut words = match table {
        "" | "robot" | "axis" => String::new(),
        "friction" => "friction ".to_owned(),
        _ if table.starts_with("friction.") => format!("{} friction ", &table["friction.".len()..]),
        _ => format!("{} ", table.replace(['_', '.'], " ")),
    };
    words += &name.replace('_', " ");
    if unit != "1" {
        words += &format!(" [{unit}]");
    }
    words
}

#[cfg(test)]
mod tests {
    use flqr_core::control::ControllerKind;
    use flqr_core::model_file::presets;

    use super::*;
    use crate::layout::Side;
    use crate::pages::Tab;

    fn begin() -> Undo {
        let session = Session::new(presets::paper(), ControllerKind::Flqr);
        let base = Base { saved: session.clone(), path: None };
        let layout = Node::default();
        Undo::new(
            Content {
                session,
                base: 0,
                ledger: 0,
                comparison: Comparison::default(),
                experiment: Settings::default(),
                layout,
            },
            base,
        )
    }

    fn with_weight(undo: &Undo, pitch: f64) -> Content {
        let mut content = undo.now().clone();
        let robot = content.session.robot_mut().unwrap();
        let mut weights = robot.weights.unwrap();
        weights.q[(2, 2)] = pitch;
        robot.weights = Some(weights);
        content
    }

    #[test]
    fn a_drag_is_one_step_and_is_named_by_its_ends() {
        let mut undo = begin();
        let start = undo.now().clone();
        for pitch in [110.0, 120.0, 130.0] {
            let content = with_weight(&undo, pitch);
            undo.watch(Some(content), false);
        }
        assert_eq!(undo.undoable().count(), 0, "the button is still down");
        let end = with_weight(&undo, 140.0);
        undo.watch(Some(end.clone()), true);
        let names: Vec<_> = undo.undoable().map(str::to_owned).collect();
        assert_eq!(names.len(), 1);
        assert!(names[0].contains("→ 140"), "{names:?}");
        let (_, back) = undo.go(false).unwrap();
        assert_eq!(back, start);
        let (_, forth) = undo.go(true).unwrap();
        assert_eq!(forth, end);
        assert!(undo.go(true).is_none());
    }

    #[test]
    fn keys_of_a_model_file_are_described_with_their_units() {
        for (key, words_of_it) in [
            ("lqr.q_diagonal[3]", "pitch weight"),
            ("robot.body_mass_kg", "body mass [kg]"),
            ("robot.wheel_inertia_kg_m2", "wheel inertia [kg m²]"),
            ("robot.gravity_m_s2", "gravity [m/s²]"),
            ("friction.left.viscous_nm_s_rad", "left friction viscous [N m s/rad]"),
            ("limits.torque_nm", "limits torque [N m]"),
            ("compensation.ratio", "compensation ratio"),
            ("lqr.q[1][1]", "displacement weight"),
            ("lqr.q[1][3]", "displacement with pitch weight"),
            ("lqr.r[2][1]", "right torque with left torque weight"),
            ("lqr.q[9][1]", "lqr q[9][1]"),
            ("name", "name"),
        ] {
            assert_eq!(words(key), words_of_it);
        }
        // No two values of a model are told alike.
        let mut all: Vec<String> = presets::paper().entries().keys().map(|key| words(key)).collect();
        let count = all.len();
        all.sort();
        all.dedup();
        assert_eq!(all.len(), count);
    }

    #[test]
    fn a_new_step_forgets_what_was_undone_and_old_steps_go() {
        let mut undo = begin();
        for pitch in 0..300 {
            let content = with_weight(&undo, 200.0 + f64::from(pitch));
            undo.watch(Some(content), true);
        }
        assert_eq!(undo.undoable().count(), LONGEST);
        undo.go(false).unwrap();
        undo.go(false).unwrap();
        assert_eq!(undo.redoable().count(), 2);
        let mut content = undo.now().clone();
        content.session.controller = ControllerKind::Lqr;
        undo.watch(Some(content), true);
        assert_eq!(undo.redoable().count(), 0);
        assert_eq!(undo.undoable().next(), Some("controller LQR"));
    }

    #[test]
    fn which_page_is_in_front_is_no_step_but_its_place_is() {
        let mut undo = begin();
        let mut content = undo.now().clone();
        content.layout = Node::Tabs { tabs: Tab::ALL.to_vec(), active: Some(Tab::Robot) };
        undo.watch(Some(content), true);
        assert_eq!(undo.undoable().count(), 0);
        let mut content = undo.now().clone();
        content.layout = content.layout.moved(Tab::Robot, Side::Right);
        undo.call("Robot to the right");
        undo.watch(Some(content), true);
        assert_eq!(undo.undoable().collect::<Vec<_>>(), ["Robot to the right"]);
    }
}
