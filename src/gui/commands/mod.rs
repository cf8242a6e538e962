//! List of all commands of the window, from which menus, shortcuts, help and palette are made.

mod entries;
mod menu;
mod palette;

use std::borrow::Cow;
use std::path::Path;
use std::sync::LazyLock;

use egui::{Context, KeyboardShortcut};
use flqr_core::control::ControllerKind;

use crate::command::{Command, Source};
use crate::pages::Tab;

pub(crate) use entries::{GESTURES, STOP_KEYS};
pub(crate) use menu::{keys_ui, menu_ui};
pub(crate) use palette::Palette;

/// Menu of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Menu {
    File,
    Presets,
    Edit,
    View,
    Run,
    Help,
}

impl Menu {
    pub(crate) const ALL: [Self; 6] =
        [Self::File, Self::Presets, Self::Edit, Self::View, Self::Run, Self::Help];

    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::File => "File",
            Self::Presets => "Presets",
            Self::Edit => "Edit",
            Self::View => "View",
            Self::Run => "Run",
            Self::Help => "Help",
        }
    }
}

/// Conditions and payload of a command.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Situation<'a> {
    pub(crate) tab: Tab,
    pub(crate) source: Source,
    pub(crate) paused: bool,
    pub(crate) replay_is_paused: bool,
    pub(crate) has_robot: bool,
    pub(crate) has_reference: bool,
    pub(crate) has_log: bool,
    pub(crate) fit_runs: bool,
    pub(crate) refine_runs: bool,
    /// True if the Refine page has plots of a residual.
    pub(crate) has_residual: bool,
    pub(crate) experiment_runs: bool,
    pub(crate) is_connected: bool,
    pub(crate) is_hot: bool,
    /// True if the connected robot runs other gains than those of the design.
    pub(crate) gains_wait: bool,
    pub(crate) controller: ControllerKind,
    pub(crate) model_path: Option<&'a Path>,
    pub(crate) can_undo: bool,
    pub(crate) can_redo: bool,
    pub(crate) is_dark: bool,
    pub(crate) zoom: f32,
    pub(crate) is_usual_layout: bool,
}

/// Command to send, or the reason why it is unavailable.
pub(crate) type Sent = Result<Command, &'static str>;

/// One command.
pub(crate) struct Entry {
    /// Unique name for scripts and tests.
    pub(crate) id: Cow<'static, str>,
    pub(crate) menu: Menu,
    pub(crate) name: Cow<'static, str>,
    pub(crate) help: Cow<'static, str>,
    /// Further words by which the palette finds it.
    also: &'static str,
    /// Submenu.
    group: Option<&'static str>,
    pub(crate) keys: Vec<KeyboardShortcut>,
    send: Box<dyn Fn(&Situation<'_>) -> Sent + Send + Sync>,
}

impl Entry {
    /// Adds search keywords.
    fn also(self, words: &'static str) -> Self {
        Self { also: words, ..self }
    }

    /// Sets the menu.
    fn group(self, title: &'static str) -> Self {
        Self { group: Some(title), ..self }
    }

    /// Returns the command to send, or the reason why it is unavailable.
    pub(crate) fn send(&self, situation: &Situation<'_>) -> Sent {
        (self.send)(situation)
    }

    /// Name for screen readers, with the reason if the command is unavailable.
    fn accessible_name(&self, sent: &Sent) -> String {
        match sent {
            Ok(_) => self.name.to_string(),
            Err(reason) => format!("{}: {reason}", self.name),
        }
    }

    /// Displayed shortcut.
    pub(crate) fn keys_text(&self, ctx: &Context) -> String {
        let keys: Vec<_> = self.keys.iter().map(|keys| ctx.format_shortcut(keys)).collect();
        keys.join(", ")
    }
}

/// All commands, in the order of the menus.
pub(crate) static ALL: LazyLock<Vec<Entry>> = LazyLock::new(entries::all);

/// Returns the command whose shortcut was pressed, and consumes the shortcut. Shortcuts with more
/// modifiers go first, because those with fewer would match too.
pub(crate) fn pressed(ctx: &Context) -> Option<&'static Entry> {
    static KEYS: LazyLock<Vec<(KeyboardShortcut, usize)>> = LazyLock::new(|| {
        let keys = |(index, entry): (usize, &Entry)| {
            entry.keys.iter().map(move |keys| (*keys, index)).collect::<Vec<_>>()
        };
        let mut all: Vec<_> = ALL.iter().enumerate().flat_map(keys).collect();
        let modifiers = |keys: &KeyboardShortcut| {
            let held = keys.modifiers;
            u32::from(held.shift) + u32::from(held.alt) + u32::from(held.command || held.ctrl)
        };
        all.sort_by_key(|(keys, _)| std::cmp::Reverse(modifiers(keys)));
        all
    });
    // A field has a separate undo.
    let typing = ctx.text_edit_focused();
    ctx.input_mut(|input| {
        let free = |entry: &Entry| !(typing && matches!(&*entry.id, "undo" | "redo"));
        KEYS.iter()
            .filter(|(_, index)| free(&ALL[*index]))
            .find(|(keys, _)| input.consume_shortcut(keys))
            .map(|(_, index)| &ALL[*index])
    })
}

/// Appends the shortcut of the command `id` to `help`.
pub(crate) fn with_keys(ctx: &Context, help: &str, id: &str) -> String {
    let keys = ALL.iter().find(|entry| entry.id == id).map(|entry| entry.keys_text(ctx)).unwrap_or_default();
    if keys.is_empty() { help.to_owned() } else { format!("{help} ({keys})") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_commands_share_a_name_or_keys() {
        for (index, entry) in ALL.iter().enumerate() {
            assert!(!entry.help.is_empty() && !entry.name.is_empty(), "{}", entry.id);
            for other in &ALL[index + 1..] {
                assert_ne!(entry.id, other.id);
                assert_ne!(entry.name, other.name);
                for keys in &entry.keys {
                    assert!(!other.keys.contains(keys), "{} and {}: {keys:?}", entry.id, other.id);
                }
            }
        }
    }

    #[test]
    fn every_command_is_the_first_that_the_palette_finds_by_its_name() {
        for entry in ALL.iter() {
            let found = palette::found(&entry.name);
            assert_eq!(found.first().map(|index| &ALL[*index].id), Some(&entry.id));
        }
    }

    #[test]
    fn every_menu_has_commands_and_every_page_has_one() {
        for menu in Menu::ALL {
            assert!(ALL.iter().any(|entry| entry.menu == menu), "{menu:?}");
        }
        for tab in Tab::ALL {
            assert!(ALL.iter().any(|entry| entry.id == format!("tab-{}", tab.key())));
        }
    }
}
