//! A twin of a subject: the same person, marked at the same vertices, under muscles drawn by a seed, with forces that are known.

use nalgebra::{Point2, Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

use super::ground::{Ground, apart, membrane};
use crate::camera::RigidMotion;
use crate::expression::{Actuators, Expression};
use crate::muscle::{LawKind, MuscleLaw};
use crate::project::{Mark, Project, Role};
use crate::simulate::Ended;
use crate::study::scene::muscles_elsewhere;
use crate::study::twin::{TwinSettings, head_motion, normal_pair};
use crate::study::yardstick::gentle;
use crate::study::{MembraneFace, MembraneSettings};

/// How much of a muscle or an expression is used: at the whole of it skin is stretched to where the table is steepest.
const INTENSITY: std::ops::RangeInclusive<f64> = 0.2..=0.8;
/// Most muscles by chance.
const MOST_MUSCLES: usize = 5;
/// Expressions drawn for a seed until one has an equilibrium that is found, and shows.
const DRAWN: u64 = 12;
/// An expression shows where it moves compared skin by so much, mm: nobody asks for the forces of less.
const SHOWS_MM: f64 = 1.0;
/// A still point may be moved by the expression so far, mm: far below what a hand can mark.
const STILL_WITHIN_MM: f64 = 0.02;
/// But the stillest of them stay still points.
const FEWEST_STILL: usize = 6;

/// An expression whose forces are known.
pub(super) struct Truth {
    /// Where every vertex goes, mm.
    pub(super) last: Vec<Point3<f64>>,
    /// What it takes there, N.
    pub(super) force: Vec<Vector3<f64>>,
    /// Whether a vertex lies where skin is hardly stretched.
    gentle: Vec<bool>,
    /// Muscles that pull.
    pub(super) muscles: usize,
    head: RigidMotion,
    /// Still points that the expression moves.
    moved: Vec<u32>,
    seed: u64,
}

impl Truth {
    /// The seed's expression: one to five muscles, or one or two of the basic expressions, under one of the laws and by muscles that are not
    /// quite where the face has them.
    pub(super) fn new(ground: &Ground, seed: u64) -> Result<Self, String> {
        let law = LawKind::ALL[Pcg64::seed_from_u64(seed ^ 0x6c61_7773).random_range(0..LawKind::ALL.len())];
        let settings = MembraneSettings { law: MuscleLaw::default_of(law), ..membrane(&ground.project.settings) };
        let puller = muscles_elsewhere(&ground.person, seed).map_err(|e| e.to_string())?;
        let mut face = MembraneFace::new(&puller, &settings).map_err(|e| e.to_string())?;
        let mut why = String::new();
        for draw in 0..DRAWN {
            let expression = drawn(ground, face.actuators(), seed, draw);
            let truth = face.truth(&expression).map_err(|e| e.to_string())?;
            let far = apart(&truth.last, ground.person.mesh().positions());
            let shows = ground.compared.iter().any(|v| far[*v] >= SHOWS_MM);
            if truth.ended != Ended::Converged {
                truth.ended.label().clone_into(&mut why);
            } else if !shows {
                "none of the expressions moves the skin that is compared".clone_into(&mut why);
            } else {
                return Ok(Self::of(ground, truth.last, truth.force, expression.activations.len(), seed));
            }
        }
        Err(format!("no truth: {why}"))
    }

    fn of(ground: &Ground, last: Vec<Point3<f64>>, force: Vec<Vector3<f64>>, muscles: usize, seed: u64) -> Self {
        let gentle = gentle(ground.person.mesh(), &last, ground.project.settings.skin_thickness_mm);
        let far = apart(&last, ground.person.mesh().positions());
        let still = ground.project.features.iter().filter(|(_, f)| f.role == Role::Still).map(|(v, _)| *v);
        let mut still: Vec<u32> = still.filter(|v| (*v as usize) < far.len()).collect();
        still.sort_by(|a, b| far[*a as usize].total_cmp(&far[*b as usize]));
        let moved = still.into_iter().skip(FEWEST_STILL).filter(|v| far[*v as usize] > STILL_WITHIN_MM).collect();
        let head = TwinSettings { seed, ..TwinSettings::default() };
        Self {
            gentle,
            head: if ground.head_moves { head_motion(&head) } else { RigidMotion::default() },
            last,
            force,
            muscles,
            moved,
            seed,
        }
    }

    /// The vertices that are compared.
    pub(super) fn compared(&self, ground: &Ground) -> Vec<usize> {
        ground.compared.iter().copied().filter(|v| self.gentle[*v]).collect()
    }

    /// The project with its marks on this twin. Every mark errs by `times` what the project states of it, and says so.
    pub(super) fn project(&self, ground: &Ground, times: f64) -> Project {
        let mut random = Pcg64::seed_from_u64(self.seed ^ 0x6c61_6464);
        let mut project = ground.project.clone();
        project.settings.marking_sigma_px *= times;
        let first = ground.person.mesh().positions();
        let mut put = |mark: &mut Mark, at: Point2<f64>| {
            // Drawn for every mark at every size of the error: what grows is the error alone.
            let [a, b] = normal_pair(&mut random);
            let own = times * ground.project.sigma_px(mark);
            mark.at_px = [at.x + own * a, at.y + own * b];
            mark.sigma_px = mark.sigma_px.map(|s| s * times);
        };
        for landmark in ground.face.landmarks() {
            if let Some(mark) = project.landmarks.get_mut(&landmark.id) {
                put(mark, ground.camera.image_from_face(&first[landmark.vertex as usize]));
            }
        }
        for (&v, feature) in &mut project.features {
            let Some((before, after)) = first.get(v as usize).zip(self.last.get(v as usize)) else { continue };
            if let Some(mark) = &mut feature.first {
                put(mark, ground.camera.image_from_face(before));
            }
            if let Some(mark) = &mut feature.last {
                put(mark, ground.camera.image_from_face(&self.head.last_from_first(after)));
            }
            if self.moved.contains(&v) {
                feature.role = Role::Skin;
            }
        }
        project
    }
}

fn drawn(ground: &Ground, actuators: &Actuators, seed: u64, draw: u64) -> Expression {
    let mut random = Pcg64::seed_from_u64(seed.wrapping_mul(DRAWN).wrapping_add(draw) ^ 0x7275_6e67);
    if ground.expressions.is_empty() || random.random_bool(0.5) {
        let mut left: Vec<&String> = ground.muscles.iter().collect();
        let count = random.random_range(1..=MOST_MUSCLES).min(left.len());
        let activations = (0..count).map(|_| {
            let chosen = left.swap_remove(random.random_range(0..left.len()));
            (chosen.clone(), random.random_range(INTENSITY))
        });
        return Expression { name: "muscles".to_owned(), activations: activations.collect(), jaw_deg: 0.0 };
    }
    let mut mixed = Expression { name: "expressions".to_owned(), ..Expression::default() };
    for _ in 0..random.random_range(1..=2_usize) {
        let basic = ground.expressions[random.random_range(0..ground.expressions.len())];
        // Where two ask for the same muscle, it follows the one that asks for more.
        let part = Expression::basic(basic, actuators).times(random.random_range(INTENSITY));
        for (id, activation) in part.activations {
            let sum = mixed.activations.entry(id).or_insert(0.0);
            *sum = sum.max(activation);
        }
        mixed.jaw_deg = mixed.jaw_deg.max(part.jaw_deg);
    }
    mixed
}
