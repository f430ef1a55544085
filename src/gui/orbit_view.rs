//! The eye that looks at the height map: a turntable about the height axis, seen through parallel rays so that heights can be compared.
//!
//! Face space here is the plan of the map: x and y of the face, z the height (mm). View space has x to the right of the screen, y up and z
//! towards the eye. Ui space is egui points, y down.

use egui::{Pos2, Rect, Vec2};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use super::action::{Action, Direction as Way};
use super::keys::{self, Hold};
use super::wheel;

/// Where the eye stands and how large it sees. `None` in the two last fields means "so that everything fits".
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbitView {
    /// Angle of the eye about the height axis, radians; 0 looks from the chin up the face, positive goes to the person's left.
    pub azimuth: f64,
    /// Angle of the eye above the plan, radians; a quarter turn looks straight at the face.
    pub elevation: f64,
    /// The point of face space that lies in the middle of the canvas, mm.
    pub target: Option<Point3<f64>>,
    /// Size of a millimetre, egui points.
    pub points_per_mm: Option<f64>,
}

/// Directions worth a button.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StandardView {
    /// As the camera sees the face; height is told by colour alone.
    Front,
    /// From above the chin, to one side: the view that shows most.
    Oblique,
    /// From the person's left: y against height.
    Side,
    /// From below the chin, as an axial scan is drawn: x against height.
    Below,
}

impl StandardView {
    /// In the order of the buttons.
    pub const ALL: [Self; 4] = [Self::Front, Self::Oblique, Self::Side, Self::Below];

    /// Text of the button.
    pub fn label(self) -> &'static str {
        match self {
            Self::Front => "Front",
            Self::Oblique => "Oblique",
            Self::Side => "Side",
            Self::Below => "Below",
        }
    }

    /// One sentence for the tooltip.
    pub fn hint(self) -> &'static str {
        match self {
            Self::Front => "As the camera sees the face",
            Self::Oblique => "From above the chin, a little to one side",
            Self::Side => "From the person's left: y against height",
            Self::Below => "From below the chin, as an axial scan: x against height",
        }
    }

    /// Azimuth and elevation, radians.
    pub fn angles(self) -> (f64, f64) {
        let degrees: (f64, f64) = match self {
            Self::Front => (0.0, 90.0),
            Self::Oblique => (-24.0, 42.0),
            Self::Side => (90.0, 0.0),
            Self::Below => (0.0, 0.0),
        };
        (degrees.0.to_radians(), degrees.1.to_radians())
    }
}

impl Default for OrbitView {
    fn default() -> Self {
        Self::standard(StandardView::Oblique)
    }
}

/// Radians turned by one point of dragging: half a turn in 450 points.
const RADIANS_PER_POINT: f64 = std::f64::consts::PI / 450.0;
const FEWEST_POINTS_PER_MM: f64 = 0.05;
const MOST_POINTS_PER_MM: f64 = 400.0;

impl OrbitView {
    /// One of the directions worth a button, with everything in view.
    pub fn standard(view: StandardView) -> Self {
        let (azimuth, elevation) = view.angles();
        Self { azimuth, elevation, target: None, points_per_mm: None }
    }

    /// Whether the eye looks along one of the standard directions.
    pub fn is_standard(&self, view: StandardView) -> bool {
        let (azimuth, elevation) = view.angles();
        (self.azimuth - azimuth).abs() < 1e-9 && (self.elevation - elevation).abs() < 1e-9
    }

    /// Rotation from face space to view space: about the height axis by −azimuth, then tilted by elevation − 90°.
    pub fn view_from_face(&self) -> Rotation3<f64> {
        Rotation3::from_axis_angle(&Vector3::x_axis(), self.elevation - std::f64::consts::FRAC_PI_2)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), -self.azimuth)
    }

    /// Turns the map under the hand; `drag` in points.
    pub fn orbit_by(&mut self, drag: Vec2) {
        self.azimuth = wrap(self.azimuth - f64::from(drag.x) * RADIANS_PER_POINT);
        let quarter = std::f64::consts::FRAC_PI_2;
        self.elevation = (self.elevation + f64::from(drag.y) * RADIANS_PER_POINT).clamp(-quarter, quarter);
    }

    /// Fits `points` into `canvas` where the view does not say otherwise, and gives the projection of this frame.
    pub fn project_into(&self, canvas: Rect, points: impl Iterator<Item = Point3<f64>> + Clone) -> Projection {
        let view_from_face = *self.view_from_face().matrix();
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        for p in points {
            let p = view_from_face * p.coords;
            low = low.inf(&p);
            high = high.sup(&p);
        }
        if !low.x.is_finite() {
            (low, high) = (Vector3::repeat(-1.0), Vector3::repeat(1.0));
        }
        let span = high - low;
        let fitting = (f64::from(canvas.width()) / span.x.max(1e-6)).min(f64::from(canvas.height()) / span.y.max(1e-6));
        let points_per_mm = self.points_per_mm.unwrap_or(fitting).clamp(FEWEST_POINTS_PER_MM, MOST_POINTS_PER_MM);
        let target_in_view = self.target.map_or_else(|| (low + high) / 2.0, |target| view_from_face * target.coords);
        Projection { view_from_face, target_in_view, points_per_mm, centre: canvas.center() }
    }

    /// Takes what `projection` fitted as the view's own, so that a gesture starts from what is on the screen.
    fn settle(&mut self, projection: &Projection) {
        self.points_per_mm = Some(projection.points_per_mm);
        self.target = Some(Point3::from(projection.view_from_face.transpose() * projection.target_in_view));
    }

    /// Turns the map under the hand about what is in the middle of the canvas.
    pub fn orbit(&mut self, projection: &Projection, drag: Vec2) {
        self.settle(projection);
        self.orbit_by(drag);
    }

    /// Shifts the map with the hand; `drag` in points.
    pub fn pan(&mut self, projection: &Projection, drag: Vec2) {
        self.settle(projection);
        let shift = Vector3::new(-f64::from(drag.x), f64::from(drag.y), 0.0) / projection.points_per_mm;
        self.target = self.target.map(|t| t + projection.view_from_face.transpose() * shift);
    }

    /// Zooms by `factor`; what lies under `at` stays there.
    pub fn zoom(&mut self, projection: &Projection, factor: f64, at: Pos2) {
        self.settle(projection);
        let before = projection.points_per_mm;
        let after = (before * factor).clamp(FEWEST_POINTS_PER_MM, MOST_POINTS_PER_MM);
        let from_centre = at - projection.centre;
        let shift =
            Vector3::new(f64::from(from_centre.x), -f64::from(from_centre.y), 0.0) * (1.0 / before - 1.0 / after);
        self.points_per_mm = Some(after);
        self.target = self.target.map(|t| t + projection.view_from_face.transpose() * shift);
    }

    /// Does what a key or a menu entry names, if it means the eye; true when it did. Arrows turn it only where `arrows` says so.
    pub fn act(&mut self, action: Action, projection: &Projection, arrows: bool) -> bool {
        /// One press of an arrow turns as a drag over so many points: 5°.
        const ARROW_POINTS: f32 = 12.5;
        match action {
            Action::Fit => (self.target, self.points_per_mm) = (None, None),
            Action::ZoomIn => self.zoom(projection, 1.25, projection.centre),
            Action::ZoomOut => self.zoom(projection, 0.8, projection.centre),
            Action::Nudge(way, _) if arrows => {
                let [right, down] = match way {
                    Way::Left => [-1.0, 0.0],
                    Way::Right => [1.0, 0.0],
                    Way::Up => [0.0, -1.0],
                    Way::Down => [0.0, 1.0],
                };
                self.orbit(projection, Vec2::new(right, down) * ARROW_POINTS);
            }
            _ => return false,
        }
        true
    }

    /// Turns, shifts and zooms the view under the hand; a double click goes `home`.
    pub fn steer(&mut self, ui: &egui::Ui, response: &egui::Response, home: Self, fit: &dyn Fn(&Self) -> Projection) {
        let (shift, delta, pointer) = ui.input(|i| (i.modifiers.shift, i.pointer.delta(), i.pointer.hover_pos()));
        let pan_key = shift || keys::is_held(ui.ctx(), Hold::Pan);
        // The last motion and the release can come in one frame.
        let drag = if response.drag_delta() == Vec2::ZERO { delta } else { response.drag_delta() };
        if (response.dragged() || response.drag_stopped()) && drag != Vec2::ZERO {
            let by = |button| response.dragged_by(button) || response.drag_stopped_by(button);
            if by(egui::PointerButton::Middle) || pan_key {
                self.pan(&fit(self), drag);
            } else {
                self.orbit(&fit(self), drag);
            }
        }
        if response.double_clicked() {
            *self = home;
        }
        if let Some(at) = pointer.filter(|_| response.container_contains_pointer()) {
            let factor = wheel::zoom_factor(ui);
            if (factor - 1.0).abs() > 1e-6 {
                self.zoom(&fit(self), factor, at);
            }
        }
    }
}

/// Gives the canvas the keyboard when it is clicked or dragged, and keeps the arrows from carrying it away; whether it has it.
pub fn keep_focus(ui: &egui::Ui, response: &egui::Response) -> bool {
    if response.clicked() || response.dragged() {
        response.request_focus();
    }
    let arrows = egui::EventFilter { horizontal_arrows: true, vertical_arrows: true, ..egui::EventFilter::default() };
    ui.memory_mut(|m| m.set_focus_lock_filter(response.id, arrows));
    response.has_focus()
}

fn wrap(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    (angle + turn / 2.0).rem_euclid(turn) - turn / 2.0
}

/// The map from face space to the canvas for one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projection {
    /// Rotation from face space to view space.
    pub view_from_face: Matrix3<f64>,
    /// What lies in the middle of the canvas, view space, mm.
    pub target_in_view: Vector3<f64>,
    /// Size of a millimetre, points.
    pub points_per_mm: f64,
    /// Middle of the canvas, ui space.
    pub centre: Pos2,
}

impl Projection {
    /// Where a point of face space is drawn.
    pub fn ui_from_face(&self, x: &Point3<f64>) -> Pos2 {
        let from_target = (self.view_from_face * x.coords - self.target_in_view) * self.points_per_mm;
        self.centre + Vec2::new(from_target.x as f32, -from_target.y as f32)
    }

    /// The direction in face space that points at the eye.
    pub fn towards_eye_in_face(&self) -> Vector3<f64> {
        self.view_from_face.row(2).transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CANVAS: Rect = Rect { min: Pos2::new(100.0, 50.0), max: Pos2::new(700.0, 450.0) };

    fn corners() -> impl Iterator<Item = Point3<f64>> + Clone {
        [[-70.0, -90.0, 0.0], [70.0, -90.0, 0.0], [-70.0, 110.0, 0.0], [70.0, 110.0, 40.0]]
            .into_iter()
            .map(Point3::from)
    }

    #[test]
    fn turning_keeps_lengths_and_handedness() {
        let mut view = OrbitView::default();
        for step in 0..50 {
            view.orbit_by(Vec2::new(37.0 * step as f32, -23.0 + step as f32));
            let r = view.view_from_face();
            let v = Vector3::new(3.0, -4.0, 12.0);
            assert!(((r * v).norm() - 13.0).abs() < 1e-12, "3, 4, 12 has length 13");
            assert!((r.matrix().determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_standard_views_look_where_they_say() {
        let seen = |view, x, y, z| OrbitView::standard(view).view_from_face() * Vector3::new(x, y, z);
        // Front: the face's own x and y, height towards the eye.
        assert!((seen(StandardView::Front, 1.0, 2.0, 3.0) - Vector3::new(1.0, 2.0, 3.0)).norm() < 1e-12);
        // Below: x to the right, height up, the chin (−y) nearest.
        assert!((seen(StandardView::Below, 1.0, 2.0, 3.0) - Vector3::new(1.0, 3.0, -2.0)).norm() < 1e-12);
        // Side, from +x: y to the right, height up, +x nearest.
        assert!((seen(StandardView::Side, 1.0, 2.0, 3.0) - Vector3::new(2.0, 3.0, 1.0)).norm() < 1e-12);
    }

    #[test]
    fn everything_fits_and_the_scale_is_the_same_in_both_directions() {
        for view in StandardView::ALL {
            let projection = OrbitView::standard(view).project_into(CANVAS, corners());
            for p in corners() {
                assert!(CANVAS.expand(0.01).contains(projection.ui_from_face(&p)), "{view:?} {p}");
            }
        }
        let front = OrbitView::standard(StandardView::Front).project_into(CANVAS, corners());
        // 200 mm of height in 400 points, and 140 mm of width leave room: 2 points a millimetre.
        assert!((front.points_per_mm - 2.0).abs() < 1e-9);
        let a = front.ui_from_face(&Point3::new(0.0, 0.0, 0.0));
        let b = front.ui_from_face(&Point3::new(10.0, 5.0, 0.0));
        assert!((b - a - Vec2::new(20.0, -10.0)).length() < 1e-3);
    }

    #[test]
    fn zoom_keeps_the_point_under_the_cursor_and_pan_follows_the_hand() {
        let mut view = OrbitView::default();
        let p = Point3::new(20.0, 60.0, 15.0);
        let before = view.project_into(CANVAS, corners());
        let at = before.ui_from_face(&p);
        view.zoom(&before, 2.5, at);
        let zoomed = view.project_into(CANVAS, corners());
        assert!((zoomed.ui_from_face(&p) - at).length() < 0.01);
        assert!((zoomed.points_per_mm / before.points_per_mm - 2.5).abs() < 1e-9);
        view.pan(&zoomed, Vec2::new(31.0, -7.0));
        let panned = view.project_into(CANVAS, corners());
        assert!((panned.ui_from_face(&p) - at - Vec2::new(31.0, -7.0)).length() < 0.01);
    }

    #[test]
    fn orbiting_keeps_the_middle_of_the_canvas_and_the_scale() {
        let mut view = OrbitView::default();
        let before = view.project_into(CANVAS, corners());
        view.orbit(&before, Vec2::new(60.0, 25.0));
        let after = view.project_into(CANVAS, corners());
        let middle = Point3::from(before.view_from_face.transpose() * before.target_in_view);
        assert!((after.ui_from_face(&middle) - CANVAS.center()).length() < 0.01);
        assert!((after.points_per_mm - before.points_per_mm).abs() < 1e-12);
    }
}
