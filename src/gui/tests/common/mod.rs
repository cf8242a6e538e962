//! What all tests of the window share: opening it, driving it by names, waiting for what it says of itself.

#![allow(dead_code, reason = "each test program uses a part of it")]

pub(crate) mod script;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use egui::{
    Event, Key, Modifiers, PointerButton, Pos2, Vec2, ViewportCommand, ViewportEvent, ViewportId, vec2,
};
use egui_kittest::{Harness, kittest::Queryable};
use flqr_core::model::Model;
use flqr_gui::{App, Tab, WindowOptions};
use serde_json::Value;

/// A robot with weights of its own, so that these tests don't depend on what a preset chooses.
pub(crate) const ROBOT: &str = r#"
name = "Test robot"
[robot]
body_mass_kg = 13.0
wheel_mass_kg = 1.0
wheel_inertia_kg_m2 = 0.005
wheel_radius_m = 0.1
com_height_m = 0.25
body_inertia_kg_m2 = 0.25
[friction.left]
coulomb_nm = 0.0338
static_nm = 0.0761
viscous_nm_s_rad = 0.00049
stribeck_speed_rad_s = 1.612
stribeck_exponent = 0.231
offset_nm = -0.0016
[lqr]
q_diagonal = [60.0, 30.0, 100.0, 5.0]
r_diagonal = [20.0, 20.0]
"#;
pub(crate) const SIZE: Vec2 = vec2(1280.0, 800.0);

/// The app is made in the first frame, because it needs the context.
pub(crate) type Window = Harness<'static, Option<App>>;

pub(crate) fn options(tab: Tab) -> WindowOptions {
    let model = Model::from_toml(ROBOT, "test.toml").unwrap();
    WindowOptions { tab, paused: true, recent_file: None, ..WindowOptions::new(model) }
}

pub(crate) fn open(options: WindowOptions, size: Vec2) -> Window {
    let mut window = Harness::builder().with_size(size).build_ui_state(
        move |ui: &mut egui::Ui, app: &mut Option<App>| {
            let app = app.get_or_insert_with(|| App::new(options.clone(), ui.ctx()).unwrap());
            app.logic(ui.ctx());
            app.ui(ui);
        },
        None,
    );
    window.run_steps(3);
    window
}

pub(crate) fn state(window: &Window) -> Value {
    window.state().as_ref().unwrap().snapshot()
}

/// Frames until `done` holds of the window's state; workers get their time between them.
pub(crate) fn until(window: &mut Window, what: &str, done: impl Fn(&Value) -> bool) -> Value {
    let start = Instant::now();
    loop {
        window.step();
        let state = state(window);
        if done(&state) {
            return state;
        }
        assert!(start.elapsed() < Duration::from_secs(120), "{what} did not happen: {state:#}");
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Types over what a field holds.
pub(crate) fn enter(window: &mut Window, label: &str, text: &str) {
    window.get_by_label(label).click();
    window.run_steps(2);
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.step();
    window.event(Event::Text(text.to_owned()));
    window.step();
    window.key_press(Key::Enter);
    window.run_steps(3);
}

pub(crate) fn click(window: &mut Window, label: &str) {
    window.get_by_label(label).click();
    window.run_steps(3);
}

/// Finds a command by its name, as a person would, and takes the first.
pub(crate) fn command(window: &mut Window, name: &str) {
    window.key_press_modifiers(Modifiers::COMMAND, Key::K);
    window.run_steps(3);
    window.event(Event::Text(name.to_owned()));
    window.run_steps(2);
    window.key_press(Key::Enter);
    window.run_steps(4);
}

/// A pipe at this path: it holds a reading up until something is written to it.
pub(crate) fn make_pipe(path: &Path) {
    assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// A file that is removed with the test.
pub(crate) struct TempFile(pub(crate) PathBuf);

impl TempFile {
    pub(crate) fn new(name: &str, text: &str) -> Self {
        let path = std::env::temp_dir().join(format!("flqr-gui-{}-{name}", std::process::id()));
        std::fs::write(&path, text).unwrap();
        Self(path)
    }

    pub(crate) fn name(&self) -> &str {
        self.0.to_str().unwrap()
    }
}

impl Drop for TempFile {
    fn drop(&mut self) {
        std::fs::remove_file(&self.0).ok();
    }
}

pub(crate) fn wheel(window: &Window, delta: f32) {
    window.event(Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: vec2(0.0, delta),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Modifiers::NONE,
    });
}

/// A tiny generator: the same events in every run.
pub(crate) fn next(seed: &mut u64) -> u64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *seed >> 33
}

/// A hundred frames of random input.
pub(crate) fn random_input(window: &mut Window, mut seed: u64) {
    for _ in 0..100 {
        let position = Pos2::new((next(&mut seed) % 1280) as f32, (next(&mut seed) % 800) as f32);
        window.hover_at(position);
        match next(&mut seed) % 6 {
            0 => {
                for pressed in [true, false] {
                    let button = PointerButton::Primary;
                    let modifiers = Modifiers::NONE;
                    window.event(Event::PointerButton { pos: position, button, pressed, modifiers });
                }
            }
            1 => window.drag_at(position),
            2 => window.drop_at(position),
            3 => wheel(window, (next(&mut seed) % 600) as f32 - 300.0),
            4 => {
                window.event(Event::Text(["7", "-", "e", ".", "−"][(next(&mut seed) % 5) as usize].into()));
            }
            _ => {
                let keys = [
                    Key::Tab,
                    Key::Enter,
                    Key::ArrowUp,
                    Key::ArrowRight,
                    Key::Space,
                    Key::Backspace,
                    Key::Escape,
                    Key::Num2,
                ];
                window.key_press(keys[(next(&mut seed) % 8) as usize]);
            }
        }
        window.step();
    }
}

/// Asks the window to close, and says whether it would.
pub(crate) fn closes(window: &mut Window) -> bool {
    let viewport = window.input_mut().viewports.entry(ViewportId::ROOT).or_default();
    viewport.events.push(ViewportEvent::Close);
    window.step();
    let cancelled = window.output().viewport_output[&ViewportId::ROOT].commands.clone();
    window.run_steps(2);
    !cancelled.contains(&ViewportCommand::CancelClose)
}
