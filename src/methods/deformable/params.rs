//! Parameters of the deformable model, with their ranges, labels and help texts.

use crate::methods::params::{choices, parameters, words_or_number};
use crate::methods::{MethodError, ParamDefault, ParamKind, ParamScale, Parameters};
use crate::volume::Volume;

parameters! {
    /// The parameters of the deformable model. All can be changed while it runs.
    #[serde(deny_unknown_fields)]
    pub struct DeformableParams {
        /// π_I: the intensity that the surface settles at, in the volume's units.
        pub iso: f64 = 0.0 => {
            name: "iso",
            label: "Iso value",
            help: "Intensity at which the surface settles; the object is on one side of it.",
            symbol: "πI",
            default: ParamDefault::FromData,
            unit: "intensity",
        },
        /// α_I: strength of the image force towards the iso-surface at π_I; negative if the object is brighter than
        /// `iso`.
        pub iso_force: f64 = -1.0 => {
            name: "isoForce",
            label: "Image force",
            help: "Strength with which the image inflates or deflates the surface; negative if the object is brighter than the iso value.",
            symbol: "αI",
            range: -10.0..=10.0,
            step: 0.1,
        },
        /// α_g: strength of the gradient force along the normal, which attracts the surface to bright ridges; negative
        /// values repel it from them.
        pub gradient_normal: f64 = 0.0 => {
            name: "gradientNormal",
            label: "Gradient force, normal component",
            help: "Pulls the surface along its normal to where the image is brightest.",
            symbol: "αg",
            range: -10.0..=10.0,
            step: 0.05,
        },
        /// β_g: strength of the gradient force along the tangent plane, which attracts vertices to bright ridges;
        /// negative values repel them.
        pub gradient_tangent: f64 = 0.0 => {
            name: "gradientTangent",
            label: "Gradient force, tangential component",
            help: "Lets vertices slide within the surface to where the image is brightest.",
            symbol: "βg",
            range: -10.0..=10.0,
            step: 0.05,
        },
        /// The length to which longer image gradients are shortened for the gradient force, as a share of the volume's
        /// intensity range, per voxel of the pyramid level.
        pub gradient_bound: f64 = 1.0 => {
            name: "gradientBound",
            label: "Gradient force, bound",
            help: "Image gradients are clamped to this length, so that one sharp edge does not outweigh all others.",
            range: 1e-4..=1.0,
            step: 0.01,
            unit: "range/voxel",
        },
        /// α_c: rigidity, the resistance to changes of curvature.
        pub rigidity: f64 = 0.2 => {
            name: "rigidity",
            label: "Rigidity",
            help: "Resists bending: larger values give smoother surfaces and lose fine detail.",
            symbol: "αc",
            range: 0.0..=3.0,
            step: 0.01,
        },
        /// α_e: stiffness of the edges as springs; small values even out the triangles, large ones shrink the surface.
        pub stiffness: f64 = 0.0 => {
            name: "stiffness",
            label: "Stiffness",
            help: "Makes edges springs: small values even out the triangles, large values shrink the surface.",
            symbol: "αe",
            range: 0.0..=1.0,
            step: 0.001,
        },
        /// d: the rest length of the edges as springs.
        pub rest_length: RestLength = RestLength::Zero => {
            name: "restLength",
            label: "Rest length",
            help: "Rest length of the springs: zero, the mean edge, or a given length.",
            symbol: "d",
            range: 0.0..=1e6,
            unit: "world units",
        },
        /// m: the mass of a vertex.
        pub mass: f64 = 1.0 => {
            name: "mass",
            label: "Mass",
            help: "Inertia of a vertex: heavier ones start and stop more slowly.",
            symbol: "m",
            range: 0.1..=100.0,
            step: 0.1,
        },
        /// γ: the damping coefficient, the friction that slows vertices.
        pub damping: f64 = 0.4 => {
            name: "damping",
            label: "Damping",
            help: "Friction: with too little the surface oscillates, with too much it creeps.",
            symbol: "γ",
            range: 0.01..=2.0,
            step: 0.01,
        },
        /// The integrator of the law of motion of the vertices.
        pub integrator: Integrator = Integrator::Implicit => {
            name: "integrator",
            label: "Integrator",
            help: "Implicit takes long steps and converges in the fewest iterations; Euler is the paper's; Runge–Kutta evaluates the forces four times per step and remains stable for rigidity above 0.4.",
            choices: &["implicit", "euler", "runge-kutta"],
        },
        /// Δt: the time step of an iteration; one iteration of [`Integrator::Implicit`] takes 16 of them.
        pub time_step: f64 = 1.0 => {
            name: "timeStep",
            label: "Time step",
            help: "Time that passes in one iteration; smaller steps are safer and slower.",
            symbol: "Δt",
            range: 0.01..=2.0,
            step: 0.01,
        },
        /// The largest displacement of a vertex in one iteration, as a fraction of δ, the lower edge bound.
        pub max_move: f64 = 0.3 => {
            name: "maxMove",
            label: "Largest displacement",
            help: "Largest displacement of a vertex in one iteration, as a fraction of δ; contact is found safely up to about 0.3.",
            range: 0.01..=0.5,
            step: 0.01,
            unit: "δ",
        },
        /// ε: the bound of the mean kinetic energy along the normals, ½ m (v·n)² / δ²; a level converges only below it.
        pub energy_tolerance: f64 = 1e-6 => {
            name: "energyTolerance",
            label: "Tolerance",
            help: "A level has converged when the mean kinetic energy along the normals stays below this.",
            symbol: "ε",
            range: 1e-12..=1.0,
            scale: ParamScale::Log,
        },
        /// Whether the mesh may change its sampling and topology.
        pub topology: Topology = Topology::Adaptive => {
            name: "topology",
            label: "Topology",
            help: "Adaptive lets the surface refine, split and join; fixed moves the vertices only.",
        },
        /// The degree of local adaptation to the image. At 0, as in the paper, δ is uniform, and contact is decided by
        /// distance alone; with any larger value, unless α_I is 0, the image decides on topology changes and limits
        /// rigidity, and edge lengths vary with the curvature in proportion to it.
        pub adaptivity: f64 = 1.0 => {
            name: "adaptivity",
            label: "Adaptivity",
            help: "Local adaptation to the image: keeps walls and gaps that the image shows, however thin, and varies edge lengths with curvature; 0 is the paper, in which parts nearer than the contact distance are joined.",
            range: 0.0..=1.0,
            step: 0.05,
        },
        /// Whether parts of a pyramid level's contour, its iso-surface, that the mesh lacks are added to the mesh.
        pub seeding: Seeding = Seeding::Auto => {
            name: "seeding",
            label: "Seeding",
            help: "Adds parts and cavities of the contour that the surface has not reached; automatic in runs that start from the contour.",
        },
        /// The least volume, in voxels of the volume, that a closed part or cavity must enclose to be in a contour;
        /// smaller ones are treated as noise. Seeds, parts added to the mesh, may be pieces of such parts, and need
        /// only 1/32 of it.
        pub smallest_part: f64 = 64.0 => {
            name: "smallestPart",
            label: "Smallest part",
            help: "Separate parts and cavities that enclose less than this are treated as noise and left out.",
            range: 0.0..=1e9,
            step: 1.0,
            unit: "voxels",
        },
    }
}

/// The step of the implicit integrator, as a multiple of the parameter `time_step`. With 4 it takes twice as many
/// iterations; with 64, fronts that meet pass by openings before they settle.
const IMPLICIT_STEP: f64 = 16.0;

words_or_number! {
    /// The rest length of the edges of the mesh, which act as springs.
    pub enum RestLength: ParamKind::Choice => {
        /// A given rest length in world units.
        Given,
        /// A rest length of 0: edges contract, and the surface tends to minimal area.
        Zero = "zero" => (0.0, |code: f64| code == 0.0),
        /// The mean edge length of the mesh: edges tend to equal length.
        Mean = "mean" => (-1.0, |code: f64| code < 0.0),
    }
}

choices! {
    /// The numerical integrator of the law of motion of the vertices, m ẍ + γ ẋ = f.
    pub enum Integrator {
        /// Semi-implicit Euler: one force evaluation per iteration; stable for α_c ≤ 0.4 and γ ≤ 1.
        Euler = "euler",
        /// Runge–Kutta of order 4: four force evaluations per iteration; stable for α_c up to 3.
        RungeKutta = "runge-kutta",
        /// Linearly implicit Euler with a long time step: one force evaluation per iteration; stable for all
        /// parameters, and converges in tens of iterations where the others take hundreds. Not in the paper; the
        /// forces, and so the surface, are the same.
        Implicit = "implicit",
    }
}

choices! {
    /// Whether pyramid levels are searched for parts of their contour that the mesh lacks, so that these are added.
    pub enum Seeding {
        /// Levels are searched and missing parts added only in runs that start from the contour.
        Auto = "auto",
        /// Levels are searched and missing parts added in all runs.
        On = "on",
        /// Levels are searched for missing parts only on request, by [`super::DeformableModel::seed`].
        Off = "off",
    }
}

choices! {
    /// Whether the connectivity of the mesh may change while it moves.
    pub enum Topology {
        /// Edges are split and collapsed, parts in contact joined, and necks cut, by three bounds derived from δ: the
        /// shortest and the longest edge, and the contact distance.
        Adaptive = "adaptive",
        /// Vertices move, but the mesh keeps its edges.
        Fixed = "fixed",
    }
}

impl DeformableParams {
    /// Returns the default parameters, with `iso` halfway between the least and the largest intensity of the volume.
    pub fn for_volume(volume: &Volume) -> Self {
        Self::for_range(volume.range())
    }

    /// Returns the default parameters, with `iso` halfway between the ends of a range of intensities.
    pub fn for_range([low, high]: [f64; 2]) -> Self {
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
        self.check_ranges()
    }
}
