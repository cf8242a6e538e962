//! Stacks of plots as a user drives them: by name, by keyboard, with gaps, with nothing to show.

use std::path::PathBuf;

use egui::accesskit::Role;
use egui::{Color32, Event, Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};

use super::stack::{Panel, PanelCurve, Stack};
use super::{Data, FigureFile, FigureKind, Unit};

/// A stack over its own data.
struct Page {
    stack: Stack,
    x: Vec<f64>,
    y: Vec<f64>,
    wheel: Vec<f64>,
}

impl Page {
    /// A second of a step to 1 with a gap in its middle: no number from sample 400, and no samples from 500 to 600.
    fn new() -> Self {
        let x: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-3 + if i < 500 { 0.0 } else { 0.1 }).collect();
        let y = |x: &f64| 1.0 - (-20.0 * x).exp();
        let mut values: Vec<f64> = x.iter().map(y).collect();
        values[400] = f64::NAN;
        values[401] = f64::INFINITY;
        let wheel = x.iter().map(|x| (60.0 * x).sin()).collect();
        let mut stack = Stack::new("page", 1.0);
        stack.sources = vec!["run 3: flat, FLQR, seed 7, sources 0123456789abcdef".to_owned()];
        Self { stack, x, y: values, wheel }
    }

    fn ui(&mut self, ui: &mut egui::Ui) {
        let panel = |name: &'static str, unit, key: &'static str, values| Panel {
            name: name.into(),
            unit,
            min_span: 1e-3,
            shown: true,
            curves: vec![PanelCurve {
                name: "".into(),
                key: key.into(),
                color: Color32::LIGHT_BLUE,
                data: Data::Fixed(&self.x, values),
                generation: 1,
                gap: 0.05,
            }],
            limits: vec![("limit", 1.2)],
        };
        let panels = [
            panel("pitch", Unit::Plain("rad"), "pitch_rad", &self.y),
            panel("torque", Unit::Torque(Some(0.5)), "torque_nm", &self.wheel),
        ];
        self.stack.update([self.x[0], self.x[self.x.len() - 1]]);
        ui.horizontal_wrapped(|ui| self.stack.tools_ui(ui, &panels));
        drop(self.stack.show(ui, &panels));
    }
}

type Window = Harness<'static, Page>;

fn open(size: egui::Vec2) -> Window {
    let mut window = Harness::builder()
        .with_size(size)
        .build_ui_state(|ui: &mut egui::Ui, page: &mut Page| page.ui(ui), Page::new());
    window.run_steps(3);
    window
}

fn click(window: &mut Window, label: &str) {
    window.get_by_label(label).click();
    window.run_steps(3);
}

fn cursors(window: &Window) -> [f64; 2] {
    let at = &window.state().stack.snapshot()["cursors"];
    [at[0].as_f64().unwrap(), at[1].as_f64().unwrap()]
}

/// What a reading says: the text behind its name.
fn reading(window: &Window, name: &str) -> String {
    let node = window.get_by_label_contains(name).accesskit_node();
    let label = node.value().or_else(|| node.label()).unwrap();
    label.split_once(": ").unwrap().1.to_owned()
}

#[test]
fn a_gap_is_drawn_at_every_zoom_and_reported() {
    let mut window = open(vec2(900.0, 600.0));
    window.get_by_label_contains("plot of pitch [rad], 0.00 to 1.10; pitch: mean 0.9");
    window.get_by_label_contains("998 samples");
    let plot = window.get_by_label_contains("plot of pitch").rect().center();
    window.hover_at(plot);
    for delta in [900.0, 900.0, -4000.0, 300.0] {
        for _ in 0..4 {
            window.event(Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta: vec2(0.0, delta),
                phase: egui::TouchPhase::Move,
                source: egui::MouseWheelSource::Unknown,
                modifiers: Modifiers::NONE,
            });
            window.run_steps(3);
        }
    }
}

#[test]
fn cursors_move_by_samples_and_say_what_they_see() {
    let mut window = open(vec2(1100.0, 700.0));
    click(&mut window, "Cursors");
    let before = cursors(&window);
    for (modifiers, key, active) in [
        (Modifiers::NONE, Key::ArrowRight, 1e-3),
        (Modifiers::SHIFT, Key::ArrowRight, 10e-3),
        (Modifiers::SHIFT, Key::ArrowLeft, -10e-3),
        (Modifiers::NONE, Key::ArrowLeft, -1e-3),
    ] {
        let at = cursors(&window);
        window.key_press_modifiers(modifiers, key);
        window.run_steps(2);
        let moved = cursors(&window);
        assert!((moved[0] - at[0] - active).abs() < 1e-9, "{moved:?} after {at:?}");
        assert_eq!(moved[1], at[1], "only the chosen one moves");
    }
    assert_eq!(cursors(&window), before);
    // From the start of the step to the end of the data, beyond the gap.
    for _ in 0..80 {
        window.key_press_modifiers(Modifiers::SHIFT, Key::ArrowLeft);
    }
    window.run_steps(3);
    click(&mut window, "cursor B");
    for _ in 0..80 {
        window.key_press_modifiers(Modifiers::SHIFT, Key::ArrowRight);
    }
    window.run_steps(3);
    assert_eq!(cursors(&window), [0.0, 1.099]);
    assert_eq!(reading(&window, "pitch A: "), "0.0000");
    assert_eq!(reading(&window, "pitch B: "), "1.0000");
    // 2 % of the change remains after ln(50)/20 s.
    assert_eq!(reading(&window, "pitch settling: "), "0.196 s");
    assert_eq!(reading(&window, "pitch overshoot: "), "0.0 %");
    assert_eq!(reading(&window, "torque max: "), "1.0000");
    window.get_by_label("Δt 1.0990 s   1/Δt 0.9099 Hz");
    // A cursor is dragged with the pointer, too.
    let plot = window.get_by_label_contains("plot of torque").rect();
    let at = Pos2::new(plot.right() - 2.0, plot.center().y);
    for (pos, pressed) in
        [(at, Some(true)), (at - vec2(40.0, 0.0), None), (at - vec2(200.0, 0.0), Some(false))]
    {
        window.hover_at(pos);
        if let Some(pressed) = pressed {
            let (button, modifiers) = (PointerButton::Primary, Modifiers::NONE);
            window.event(Event::PointerButton { pos, button, pressed, modifiers });
        }
        window.run_steps(2);
    }
    let [a, b] = cursors(&window);
    assert!(a == 0.0 && b < 1.05, "{a} {b}");
}

#[test]
fn spectrum_units_and_second_axis_can_be_chosen() {
    let mut window = open(vec2(1100.0, 700.0));
    click(&mut window, "A");
    window.get_by_label_contains("plot of torque [A]");
    click(&mut window, "N m");
    click(&mut window, "Signals");
    window.get_by_label_contains("Second axis of pitch").click();
    window.run_steps(3);
    window.get_by_role_and_label(Role::RadioButton, "torque").click();
    window.run_steps(3);
    let second = window.state().stack.snapshot()["second_axis"].clone();
    assert_eq!(second, serde_json::json!({ "pitch": "torque_nm" }));
}

#[test]
fn the_spectrum_names_its_strongest_frequency() {
    let mut window = open(vec2(1100.0, 700.0));
    click(&mut window, "Spectrum");
    window.get_by_label("spectrum of torque [N m]");
    // 60 rad/s is 9.55 Hz; the longest part without a gap is half a second.
    let strongest = |window: &Window| {
        window.query_all_by_label_contains(" Hz").find_map(|node| {
            let label = node.accesskit_node().value()?;
            label.strip_suffix(" Hz")?.parse::<f64>().ok().filter(|hz| *hz > 5.0)
        })
    };
    // A worker makes it.
    for _ in 0..1000 {
        window.step();
        if strongest(&window).is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let found = strongest(&window);
    assert!((found.unwrap() - 9.55).abs() < 1.0, "{found:?}");
    click(&mut window, "Density");
    window.get_by_label("spectrum of torque [(N m)²/Hz]");
}

#[test]
fn the_visible_range_is_saved_and_files_are_replaced_only_after_a_question() {
    let folder = std::env::temp_dir().join(format!("flqr-figure-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let mut window = open(vec2(1100.0, 700.0));
    click(&mut window, "Export");
    let save = |window: &mut Window, kind: &str, name: &str| -> PathBuf {
        let path = folder.join(name);
        click(window, kind);
        window.get_by_label("figure path").click();
        window.run_steps(2);
        window.key_press_modifiers(Modifiers::COMMAND, Key::A);
        window.step();
        window.event(Event::Text(path.display().to_string()));
        window.step();
        window.key_press(Key::Enter);
        for _ in 0..500 {
            window.step();
            if path.metadata().is_ok_and(|found| found.len() > 100) {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
        window.run_steps(3);
        path
    };
    let csv = std::fs::read_to_string(save(&mut window, "CSV", "range.csv")).unwrap();
    let of = "run 3: flat, FLQR, seed 7, sources 0123456789abcdef";
    let head = format!("# {of}\ntime_s,pitch_rad,torque_nm\n0,0,0\n");
    assert!(csv.starts_with(&head), "{}", &csv[..160]);
    assert_eq!(csv.lines().count(), 1002);
    let svg = std::fs::read_to_string(save(&mut window, "SVG", "range.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    assert!(svg.contains("pitch, rad") && svg.contains(of) && !svg.contains("NaN"), "{svg}");
    std::fs::write(folder.join("range.csv"), "precious, and longer than what is looked for ".repeat(5))
        .unwrap();
    save(&mut window, "CSV", "range.csv");
    for _ in 0..200 {
        window.step();
        if window.query_by_label("Replace").is_some() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(std::fs::read_to_string(folder.join("range.csv")).unwrap().starts_with("precious"));
    click(&mut window, "Replace");
    let replaced =
        || std::fs::read_to_string(folder.join("range.csv")).is_ok_and(|text| text.starts_with("# run 3"));
    for _ in 0..500 {
        window.step();
        if replaced() {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    assert!(replaced(), "the file is replaced after the question");
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn without_a_dialog_the_form_says_why_once_and_waits_for_a_path() {
    let mut window = open(vec2(1100.0, 700.0));
    let file = FigureFile { stack: "page", kind: FigureKind::Svg };
    file.answer(&window.ctx, Err("There is no file dialog here.".to_owned()));
    window.run_steps(3);
    assert_eq!(window.query_all_by_label("There is no file dialog here.").count(), 1);
    assert!(window.get_by_label("figure path").accesskit_node().is_focused());
    window.event(Event::Text("a.svg".to_owned()));
    window.run_steps(2);
    assert!(window.query_by_label("There is no file dialog here.").is_none(), "typing answers it");
    window.get_by_label("figure width");
    window.get_by_label("Save figure");
    window.key_press_modifiers(Modifiers::COMMAND, Key::A);
    window.step();
    window.event(Event::Text("a.csv".to_owned()));
    window.run_steps(2);
    window.get_by_label("Save data");
    assert!(window.query_by_label("figure width").is_none(), "the ending says what is saved");
}

#[test]
fn nothing_to_show_and_no_room_are_no_trouble() {
    for size in [vec2(0.0, 0.0), vec2(30.0, 20.0), vec2(300.0, 150.0)] {
        let mut window = open(size);
        window.state_mut().x.truncate(1);
        window.run_steps(2);
        for value in [f64::NAN, f64::MAX, f64::INFINITY] {
            let page = window.state_mut();
            *page = Page::new();
            page.y.iter_mut().for_each(|y| *y = value);
            page.wheel.iter_mut().step_by(2).for_each(|y| *y = -value);
            window.run_steps(2);
        }
    }
}
