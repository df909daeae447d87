//! Parameters of the deformable model, with their ranges, labels and help texts.

use crate::methods::{MethodError, ParamDefault, ParamKind, ParamScale, ParamSpec};
use crate::volume::Volume;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The parameters of the deformable model. All can be changed while it runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase", deny_unknown_fields)]
pub struct DeformableParams {
    /// π_I: the intensity that the surface settles at, in the volume's units.
    pub iso: f64,
    /// α_I: strength of the image force towards the iso-surface at π_I; negative if the object is brighter than `iso`.
    pub iso_force: f64,
    /// α_g: strength of the gradient force along the normal, which attracts the surface to bright ridges; negative
    /// values repel it from them.
    pub gradient_normal: f64,
    /// β_g: strength of the gradient force along the tangent plane, which attracts vertices to bright ridges; negative
    /// values repel them.
    pub gradient_tangent: f64,
    /// The length to which longer image gradients are shortened for the gradient force, as a share of the volume's
    /// intensity range, per voxel of the pyramid level.
    pub gradient_bound: f64,
    /// α_c: rigidity, the resistance to changes of curvature.
    pub rigidity: f64,
    /// α_e: stiffness of the edges as springs; small values even out the triangles, large ones shrink the surface.
    pub stiffness: f64,
    /// d: the rest length of the edges as springs.
    pub rest_length: RestLength,
    /// m: the mass of a vertex.
    pub mass: f64,
    /// γ: the damping coefficient, the friction that slows vertices.
    pub damping: f64,
    /// The integrator of the law of motion of the vertices.
    pub integrator: Integrator,
    /// Δt: the time step of an iteration; one iteration of [`Integrator::Implicit`] takes 16 of them.
    pub time_step: f64,
    /// The largest displacement of a vertex in one iteration, as a fraction of δ, the lower edge bound.
    pub max_move: f64,
    /// ε: the bound of the mean kinetic energy along the normals, ½ m (v·n)² / δ²; a level converges only below it.
    pub energy_tolerance: f64,
    /// Whether the mesh may change its sampling and topology.
    pub topology: Topology,
    /// The degree of local adaptation to the image. At 0, as in the paper, δ is uniform, and contact is decided by
    /// distance alone; with any larger value, unless α_I is 0, the image decides on topology changes and limits
    /// rigidity, and edge lengths vary with the curvature in proportion to it.
    pub adaptivity: f64,
    /// Whether parts of a pyramid level's contour, its iso-surface, that the mesh lacks are added to the mesh.
    pub seeding: Seeding,
    /// The least volume, in voxels of the volume, that a closed part or cavity must enclose to be in a contour; smaller
    /// ones are treated as noise. Seeds, parts added to the mesh, may be pieces of such parts, and need only 1/32 of
    /// it.
    pub smallest_part: f64,
}

/// The step of the implicit integrator, as a multiple of the parameter `time_step`. With 4 it takes twice as many
/// iterations; with 64, fronts that meet pass by openings before they settle.
const IMPLICIT_STEP: f64 = 16.0;

/// The rest length of the edges of the mesh, which act as springs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RestLength {
    /// A rest length of 0: edges contract, and the surface tends to minimal area.
    Zero,
    /// The mean edge length of the mesh: edges tend to equal length.
    Mean,
    /// A given rest length in world units.
    Given(f64),
}

/// The numerical integrator of the law of motion of the vertices, m ẍ + γ ẋ = f.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Semi-implicit Euler: one force evaluation per iteration; stable for α_c ≤ 0.4 and γ ≤ 1.
    Euler,
    /// Runge–Kutta of order 4: four force evaluations per iteration; stable for α_c up to 3.
    RungeKutta,
    /// Linearly implicit Euler with a long time step: one force evaluation per iteration; stable for all parameters,
    /// and converges in tens of iterations where the others take hundreds. Not in the paper; the forces, and so the
    /// surface, are the same.
    Implicit,
}

/// Whether pyramid levels are searched for parts of their contour that the mesh lacks, so that these are added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Seeding {
    /// Levels are searched and missing parts added only in runs that start from the contour.
    Auto,
    /// Levels are searched and missing parts added in all runs.
    On,
    /// Levels are searched for missing parts only on request, by [`super::DeformableModel::seed`].
    Off,
}

/// Whether the connectivity of the mesh may change while it moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Topology {
    /// Edges are split and collapsed, parts in contact joined, and necks cut, by three bounds derived from δ: the
    /// shortest and the longest edge, and the contact distance.
    Adaptive,
    /// Vertices move, but the mesh keeps its edges.
    Fixed,
}

impl DeformableParams {
    /// Returns the default parameters, with `iso` halfway between the least and the largest intensity of the volume.
    pub fn for_volume(volume: &Volume) -> Self {
        let [low, high] = volume.range();
        Self { iso: 0.5 * (low + high), ..Self::default() }
    }

    /// Returns the parameters of the paper: uniform δ and rigidity, contact by distance alone, and integration by
    /// Euler's method; the others have their defaults.
    pub fn as_published(volume: &Volume) -> Self {
        Self { adaptivity: 0.0, integrator: Integrator::Euler, ..Self::for_volume(volume) }
    }

    /// Returns the time that passes in one iteration: Δt, or [`IMPLICIT_STEP`] times Δt with the implicit integrator.
    pub(super) fn step_length(&self) -> f64 {
        match self.integrator {
            Integrator::Implicit => IMPLICIT_STEP * self.time_step,
            Integrator::Euler | Integrator::RungeKutta => self.time_step,
        }
    }

    /// Returns whether sampling, topology and rigidity adapt to the image: neither the image force nor `adaptivity` is
    /// 0.
    pub(super) fn adapts_to_image(&self) -> bool {
        self.iso_force != 0.0 && self.adaptivity > 0.0
    }

    /// Checks every numerical parameter against its accepted range.
    ///
    /// # Errors
    /// [`MethodError::InvalidArgument`] with the name of the first parameter out of range and the accepted range.
    pub fn validate(&self) -> Result<(), MethodError> {
        let given = SPECS.iter().zip(self.numbers());
        given.filter_map(|(spec, value)| Some((spec, value?))).try_for_each(|(spec, value)| spec.check(value))
    }

    /// Returns the numerical parameters in the order of [`SPECS`], by which their ranges are checked; `None` for the
    /// other parameters.
    fn numbers(&self) -> [Option<f64>; 18] {
        let rest = if let RestLength::Given(length) = self.rest_length { Some(length) } else { None };
        [
            Some(self.iso),
            Some(self.iso_force),
            Some(self.gradient_normal),
            Some(self.gradient_tangent),
            Some(self.gradient_bound),
            Some(self.rigidity),
            Some(self.stiffness),
            rest,
            Some(self.mass),
            Some(self.damping),
            None,
            Some(self.time_step),
            Some(self.max_move),
            Some(self.energy_tolerance),
            None,
            Some(self.adaptivity),
            None,
            Some(self.smallest_part),
        ]
    }
}

impl Default for DeformableParams {
    fn default() -> Self {
        Self {
            iso: 0.0,
            iso_force: -1.0,
            gradient_normal: 0.0,
            gradient_tangent: 0.0,
            gradient_bound: 1.0,
            rigidity: 0.2,
            stiffness: 0.0,
            rest_length: RestLength::Zero,
            mass: 1.0,
            damping: 0.4,
            integrator: Integrator::Implicit,
            time_step: 1.0,
            max_move: 0.3,
            energy_tolerance: 1e-6,
            topology: Topology::Adaptive,
            adaptivity: 1.0,
            seeding: Seeding::Auto,
            smallest_part: 64.0,
        }
    }
}

/// Returns the descriptions of all parameters, in the order in which a user interface should list them.
pub fn param_specs() -> Vec<ParamSpec> {
    SPECS.to_vec()
}

const SPECS: [ParamSpec; 18] = [
    ParamSpec {
        name: "iso",
        label: "Iso value",
        help: "Intensity at which the surface settles; the object is on one side of it.",
        symbol: Some("πI"),
        default: ParamDefault::FromData,
        unit: Some("intensity"),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "isoForce",
        label: "Image force",
        help: "Strength with which the image inflates or deflates the surface; negative if the object is brighter than the iso value.",
        symbol: Some("αI"),
        default: ParamDefault::Number(-1.0),
        min: Some(-10.0),
        max: Some(10.0),
        step: Some(0.1),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "gradientNormal",
        label: "Gradient force, normal component",
        help: "Pulls the surface along its normal to where the image is brightest.",
        symbol: Some("αg"),
        min: Some(-10.0),
        max: Some(10.0),
        step: Some(0.05),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "gradientTangent",
        label: "Gradient force, tangential component",
        help: "Lets vertices slide within the surface to where the image is brightest.",
        symbol: Some("βg"),
        min: Some(-10.0),
        max: Some(10.0),
        step: Some(0.05),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "gradientBound",
        label: "Gradient force, bound",
        help: "Image gradients are clamped to this length, so that one sharp edge does not outweigh all others.",
        default: ParamDefault::Number(1.0),
        min: Some(1e-4),
        max: Some(1.0),
        step: Some(0.01),
        unit: Some("range/voxel"),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "rigidity",
        label: "Rigidity",
        help: "Resists bending: larger values give smoother surfaces and lose fine detail.",
        symbol: Some("αc"),
        default: ParamDefault::Number(0.2),
        min: Some(0.0),
        max: Some(3.0),
        step: Some(0.01),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "stiffness",
        label: "Stiffness",
        help: "Makes edges springs: small values even out the triangles, large values shrink the surface.",
        symbol: Some("αe"),
        min: Some(0.0),
        max: Some(1.0),
        step: Some(0.001),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "restLength",
        label: "Rest length",
        help: "Rest length of the springs: zero, the mean edge, or a given length.",
        symbol: Some("d"),
        kind: ParamKind::Choice,
        default: ParamDefault::Choice("zero"),
        min: Some(0.0),
        max: Some(1e6),
        scale: None,
        unit: Some("world units"),
        choices: Some(&["zero", "mean"]),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "mass",
        label: "Mass",
        help: "Inertia of a vertex: heavier ones start and stop more slowly.",
        symbol: Some("m"),
        default: ParamDefault::Number(1.0),
        min: Some(0.1),
        max: Some(100.0),
        step: Some(0.1),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "damping",
        label: "Damping",
        help: "Friction: with too little the surface oscillates, with too much it creeps.",
        symbol: Some("γ"),
        default: ParamDefault::Number(0.4),
        min: Some(0.01),
        max: Some(2.0),
        step: Some(0.01),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "integrator",
        label: "Integrator",
        help: "Implicit takes long steps and converges in the fewest iterations; Euler is the paper's; Runge–Kutta evaluates the forces four times per step and remains stable for rigidity above 0.4.",
        kind: ParamKind::Choice,
        default: ParamDefault::Choice("implicit"),
        scale: None,
        choices: Some(&["implicit", "euler", "runge-kutta"]),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "timeStep",
        label: "Time step",
        help: "Time that passes in one iteration; smaller steps are safer and slower.",
        symbol: Some("Δt"),
        default: ParamDefault::Number(1.0),
        min: Some(0.01),
        max: Some(2.0),
        step: Some(0.01),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "maxMove",
        label: "Largest displacement",
        help: "Largest displacement of a vertex in one iteration, as a fraction of δ; contact is found safely up to about 0.3.",
        default: ParamDefault::Number(0.3),
        min: Some(0.01),
        max: Some(0.5),
        step: Some(0.01),
        unit: Some("δ"),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "energyTolerance",
        label: "Tolerance",
        help: "A level has converged when the mean kinetic energy along the normals stays below this.",
        symbol: Some("ε"),
        default: ParamDefault::Number(1e-6),
        min: Some(1e-12),
        max: Some(1.0),
        scale: Some(ParamScale::Log),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "topology",
        label: "Topology",
        help: "Adaptive lets the surface refine, split and join; fixed moves the vertices only.",
        kind: ParamKind::Choice,
        default: ParamDefault::Choice("adaptive"),
        scale: None,
        choices: Some(&["adaptive", "fixed"]),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "adaptivity",
        label: "Adaptivity",
        help: "Local adaptation to the image: keeps walls and gaps that the image shows, however thin, and varies edge lengths with curvature; 0 is the paper, in which parts nearer than the contact distance are joined.",
        default: ParamDefault::Number(1.0),
        min: Some(0.0),
        max: Some(1.0),
        step: Some(0.05),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "seeding",
        label: "Seeding",
        help: "Adds parts and cavities of the contour that the surface has not reached; automatic in runs that start from the contour.",
        kind: ParamKind::Choice,
        default: ParamDefault::Choice("auto"),
        scale: None,
        choices: Some(&["auto", "on", "off"]),
        ..ParamSpec::NUMBER
    },
    ParamSpec {
        name: "smallestPart",
        label: "Smallest part",
        help: "Separate parts and cavities that enclose less than this are treated as noise and left out.",
        default: ParamDefault::Number(64.0),
        min: Some(0.0),
        max: Some(1e9),
        step: Some(1.0),
        unit: Some("voxels"),
        ..ParamSpec::NUMBER
    },
];

/// The form in which a [`RestLength`] is serialised in human-readable formats: a word or a length. Binary states store
/// a single number instead.
#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum RestLengthWords {
    Word(RestWord),
    Length(f64),
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RestWord {
    Zero,
    Mean,
}

impl Serialize for RestLength {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if !serializer.is_human_readable() {
            let code = match self {
                Self::Zero => 0.0,
                Self::Mean => -1.0,
                Self::Given(length) => *length,
            };
            return code.serialize(serializer);
        }
        match self {
            Self::Zero => RestLengthWords::Word(RestWord::Zero),
            Self::Mean => RestLengthWords::Word(RestWord::Mean),
            Self::Given(length) => RestLengthWords::Length(*length),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for RestLength {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if !deserializer.is_human_readable() {
            let code = f64::deserialize(deserializer)?;
            return Ok(if code == 0.0 {
                Self::Zero
            } else if code < 0.0 {
                Self::Mean
            } else {
                Self::Given(code)
            });
        }
        Ok(match RestLengthWords::deserialize(deserializer)? {
            RestLengthWords::Word(RestWord::Zero) => Self::Zero,
            RestLengthWords::Word(RestWord::Mean) => Self::Mean,
            RestLengthWords::Length(length) => Self::Given(length),
        })
    }
}
