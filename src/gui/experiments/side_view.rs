//! The robot from its right side at the cursor's time: body, wheels, ground, and the axle's way until then.

use egui::{Align2, Color32, FontId, Painter, Pos2, Rect, Sense, Shape, Stroke, Ui, Vec2};
use flqr_core::model::{Ground, RobotParameters};
use flqr_core::simulate::Pose;

use super::run::Recorded;
use super::scene::{Camera, Figure, Subject, outline, robot_height_m, ruler, spoke};
use crate::plot::degrees;
use crate::theme::palette;

/// Most points of the axle's way that are drawn.
const TRAIL_POINTS: usize = 500;
const SPOKES: usize = 3;

/// The last pose not later than `time_s`.
pub(super) fn pose_at(run: &Recorded, time_s: f64) -> Option<usize> {
    let after = run.poses().partition_point(|timed| timed.time_s <= time_s);
    (!run.poses().is_empty()).then(|| after.saturating_sub(1))
}

/// Common range of both pictures.
pub(super) fn subject<'a>(
    runs: impl Iterator<Item = &'a Recorded>,
    parameters: &RobotParameters,
    slope_rad: f64,
) -> Subject {
    let all = runs.flat_map(Recorded::poses).map(|timed| timed.pose.state.x_m).filter(|x| x.is_finite());
    let travel_m = all.fold([0.0_f64; 2], |[low, high], x| [low.min(x), high.max(x)]);
    Subject { travel_m, height_m: robot_height_m(parameters), slope_rad }
}

/// One picture.
pub(super) struct SideView<'a> {
    pub(super) title: &'a str,
    pub(super) color: Color32,
    pub(super) run: &'a Recorded,
    /// Under the left and the right wheel.
    pub(super) grounds: &'a [Ground; 2],
    pub(super) parameters: &'a RobotParameters,
    pub(super) subject: &'a Subject,
    pub(super) time_s: f64,
}

impl SideView<'_> {
    pub(super) fn ui(&self, ui: &mut Ui, size: Vec2) {
        let (response, painter) = ui.allocate_painter(size.max(Vec2::splat(1.0)), Sense::hover());
        let response = response.accessible_name(format!("side view of {}", self.title));
        let rect = response.rect;
        painter.rect_filled(rect, 4.0, ui.visuals().extreme_bg_color);
        let Some(index) = pose_at(self.run, self.time_s) else { return };
        let pose = &self.run.poses()[index].pose;
        if !(pose.state.x_m.is_finite() && pose.state.pitch_rad.is_finite()) {
            return;
        }
        let ground_m = 0.5 * (pose.ground_height_m[0] + pose.ground_height_m[1]);
        let camera = Camera::new(rect, self.subject, pose.state.x_m, ground_m);
        let scene = Scene { painter, camera, text: ui.visuals().weak_text_color(), rect };
        let ink = ui.visuals().text_color();
        scene.ground(self.grounds, ink);
        scene.ruler();
        if let Some(target) = self.run.target_x_m() {
            scene.target(target, self.subject.height_m);
        }
        scene.trail(self.run, index, self.parameters.wheel_radius_m, self.color);
        scene.robot(&Figure::new(self.parameters, pose), self.parameters.wheel_radius_m, self.color, ink);
        let fallen = self.run.fall().is_some_and(|fall| self.time_s >= fall.time_s - 0.011);
        let error = palette(ui.visuals()).error;
        scene.caption(self.title, self.color, fallen.then_some(error), ink, pose);
    }
}

struct Scene {
    painter: Painter,
    camera: Camera,
    text: Color32,
    rect: Rect,
}

impl Scene {
    fn at(&self, [x, z]: [f64; 2]) -> Pos2 {
        self.camera.at(x, z)
    }

    /// The far ground behind, the near one in front.
    fn ground(&self, grounds: &[Ground; 2], ink: Color32) {
        let same = grounds[0] == grounds[1];
        for (side, ground) in grounds.iter().enumerate().skip(usize::from(same)) {
            let line: Vec<Pos2> =
                outline(ground, self.camera.visible()).into_iter().map(|point| self.at(point)).collect();
            let shade = if side == 0 { 0.10 } else { 0.16 };
            let deep = self.rect.bottom() + self.rect.height();
            for pair in line.windows(2) {
                let quad = vec![pair[0], pair[1], Pos2::new(pair[1].x, deep), Pos2::new(pair[0].x, deep)];
                self.painter.add(Shape::convex_polygon(quad, ink.gamma_multiply(shade), Stroke::NONE));
            }
            let width = if side == 0 { 1.0 } else { 1.5 };
            self.painter.add(Shape::line(line, Stroke::new(width, ink.gamma_multiply(0.6))));
        }
    }

    fn ruler(&self) {
        let count = f64::from(self.rect.width()) / 60.0;
        let (marks, decimals) = ruler(self.camera.visible(), count);
        let bottom = self.rect.bottom() - 3.0;
        let font = FontId::proportional(11.0);
        for mark in &marks {
            let x = self.at([*mark, 0.0]).x;
            if x < self.rect.left() + 14.0 || x > self.rect.right() - 26.0 {
                continue;
            }
            let top = bottom - 13.0;
            let stroke = Stroke::new(1.0, self.text);
            self.painter.line_segment([Pos2::new(x, top - 5.0), Pos2::new(x, top)], stroke);
            let text = format!("{mark:.decimals$}").replace('-', "−");
            self.painter.text(Pos2::new(x, bottom), Align2::CENTER_BOTTOM, text, font.clone(), self.text);
        }
        let end = Pos2::new(self.rect.right() - 6.0, bottom);
        self.painter.text(end, Align2::RIGHT_BOTTOM, "m", font, self.text);
    }

    /// Final position setpoint.
    fn target(&self, x: f64, height: f64) {
        let line = [self.at([x, 0.0]), self.at([x, 1.15 * height])];
        self.painter.add(Shape::dashed_line(
            &line,
            Stroke::new(1.0, self.text.gamma_multiply(0.6)),
            2.0,
            5.0,
        ));
        self.painter.text(line[1], Align2::CENTER_BOTTOM, "target", FontId::proportional(10.5), self.text);
    }

    fn trail(&self, run: &Recorded, until: usize, radius: f64, color: Color32) {
        let step = (until / TRAIL_POINTS).max(1);
        let indices = (0..until).step_by(step).chain(std::iter::once(until));
        let axle = |index: usize| {
            let pose = &run.poses()[index].pose;
            [pose.state.x_m, radius + 0.5 * (pose.ground_height_m[0] + pose.ground_height_m[1])]
        };
        let line: Vec<Pos2> = indices.map(|index| self.at(axle(index))).collect();
        self.painter.add(Shape::line(line, Stroke::new(3.0, color.gamma_multiply(0.45))));
    }

    fn robot(&self, figure: &Figure, radius: f64, color: Color32, ink: Color32) {
        self.wheel(figure.wheels[0], radius, figure.turn_rad, ink.gamma_multiply(0.45));
        let upright =
            [figure.axle, [figure.axle[0], figure.axle[1] + 2.2 * distance(figure.axle, figure.com)]];
        let dash = Stroke::new(1.0, self.text.gamma_multiply(0.8));
        self.painter.add(Shape::dashed_line(&upright.map(|point| self.at(point)), dash, 4.0, 4.0));
        let body = figure.body.map(|point| self.at(point)).to_vec();
        let stroke = Stroke::new(1.8, color);
        let leg = [self.at(figure.axle), self.at(middle(figure.body[0], figure.body[1]))];
        self.painter.line_segment(leg, Stroke::new(4.0, color.gamma_multiply(0.8)));
        // The front is the thicker edge.
        let front = [body[1], body[2]];
        self.painter.add(Shape::convex_polygon(body, color.gamma_multiply(0.28), stroke));
        self.painter.line_segment(front, Stroke::new(4.0, color));
        self.wheel(figure.wheels[1], radius, figure.turn_rad, ink);
        let com = self.at(figure.com);
        self.painter.line_segment([self.at(figure.axle), com], Stroke::new(1.2, color));
        self.painter.circle(com, 3.5, color, Stroke::new(1.0, ink));
    }

    fn wheel(&self, center: [f64; 2], radius: f64, turn_rad: f64, ink: Color32) {
        let (center, radius) = (self.at(center), self.camera.length(radius));
        self.painter.circle(center, radius, ink.gamma_multiply(0.12), Stroke::new(2.0, ink));
        for number in 0..SPOKES {
            let turn = turn_rad + std::f64::consts::PI * number as f64 / SPOKES as f64;
            let rim = spoke(0.85 * radius, turn);
            self.painter
                .line_segment([center - rim, center + rim], Stroke::new(1.0, ink.gamma_multiply(0.5)));
        }
        // One spoke shows the turn.
        self.painter.line_segment([center, center + spoke(0.85 * radius, turn_rad)], Stroke::new(2.0, ink));
    }

    fn caption(&self, title: &str, color: Color32, fallen: Option<Color32>, ink: Color32, pose: &Pose) {
        let top = self.rect.left_top() + egui::vec2(8.0, 5.0);
        let name = self.painter.text(top, Align2::LEFT_TOP, title, FontId::proportional(13.0), color);
        if let Some(error) = fallen {
            let place = name.right_top() + egui::vec2(8.0, 0.0);
            self.painter.text(place, Align2::LEFT_TOP, "fallen", FontId::proportional(13.0), error);
        }
        let degrees = degrees(self.painter.ctx());
        let angle = |name: &str, value: f64, decimals: usize| {
            if degrees {
                format!("{name} {}°", signed(value.to_degrees(), decimals))
            } else {
                format!("{name} {} rad", signed(value, decimals + 2))
            }
        };
        let first =
            format!("x {} m   {}", signed(pose.state.x_m, 3), angle("pitch", pose.state.pitch_rad, 2));
        let beside = [("yaw", pose.yaw_rad), ("roll", pose.roll_rad)];
        let beside = beside.into_iter().filter(|(_, value)| value.to_degrees().abs() >= 0.05);
        let second = beside.map(|(name, value)| angle(name, value, 1)).collect::<Vec<_>>().join("   ");
        for (line, text) in [first, second].into_iter().enumerate() {
            let place = self.rect.right_top() + egui::vec2(-8.0, 5.0 + 15.0 * line as f32);
            self.painter.text(place, Align2::RIGHT_TOP, text, FontId::monospace(11.5), ink);
        }
    }
}

/// A number with its sign; what rounds to zero has none but keeps its place.
fn signed(value: f64, decimals: usize) -> String {
    let text = format!("{value:+.decimals$}");
    let zero = !text.contains(|digit: char| ('1'..='9').contains(&digit));
    if zero { format!(" {}", &text[1..]) } else { text.replace('-', "−") }
}

fn middle(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
