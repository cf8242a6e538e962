//! The column map: one text that all pages share which load logs.

use std::cell::RefCell;
use std::rc::Rc;

use egui::{TextEdit, Ui};
use flqr_core::record::{ColumnMap, Mapping};

use crate::widgets::error_ui;

/// A handle on what has been typed.
#[derive(Clone, Default)]
pub(crate) struct ColumnMapForm(Rc<RefCell<String>>);

impl ColumnMapForm {
    pub(crate) fn new(map: &[Mapping]) -> Self {
        let text = map.iter().map(Mapping::to_string).collect::<Vec<_>>().join("; ");
        Self(Rc::new(RefCell::new(text)))
    }

    /// As typed.
    pub(crate) fn text(&self) -> String {
        self.0.borrow().clone()
    }

    /// Fills the text in, unless the user has typed one.
    pub(crate) fn suggest(&self, map: &str) {
        let mut text = self.0.borrow_mut();
        if text.is_empty() {
            map.clone_into(&mut text);
        }
    }

    /// Entries `ours=theirs*factor`, separated by `;` because names may have spaces.
    pub(crate) fn parse(&self) -> Result<ColumnMap, String> {
        let text = self.0.borrow();
        let entries = text.split(';').map(str::trim).filter(|entry| !entry.is_empty());
        let entries: Result<Vec<Mapping>, _> = entries.map(str::parse).collect();
        entries.and_then(ColumnMap::new).map_err(|error| format!("column map: {error}"))
    }

    pub(crate) fn ui(&self, ui: &mut Ui) {
        {
            let mut text = self.0.borrow_mut();
            let field = TextEdit::singleline(&mut *text)
                .hint_text("column map: signal=column*factor; …")
                .desired_width(f32::INFINITY);
            ui.add(field).accessible_name("column map").on_hover_text(
                "For files with other column names or units: signal=column*factor, separated by “;”.\nExample: torque_nm=current_a*0.32; motor_angle_rad=Angle (rad)",
            );
        }
        if let Err(problem) = self.parse() {
            error_ui(ui, problem);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_handed_over_is_read_back_also_with_spaces_in_names() {
        let map: Vec<Mapping> = ["motor_angle_rad=Angle (rad)", "torque_nm=Motor current*0.32"]
            .map(|entry| entry.parse().unwrap())
            .to_vec();
        let form = ColumnMapForm::new(&map);
        assert_eq!(form.text(), "motor_angle_rad=Angle (rad); torque_nm=Motor current*0.32");
        assert_eq!(form.parse().unwrap().entries(), map);
    }

    #[test]
    fn empty_entries_are_none() {
        for text in ["", "  ", ";", " ; torque_nm=a ;"] {
            let form = ColumnMapForm::default();
            form.suggest(text);
            assert_eq!(form.parse().unwrap().entries().len(), usize::from(text.contains('=')), "{text:?}");
        }
    }
}
