//! Defines the trials of the stress battery.

use super::{Expectation, Trial};
use crate::cases::{
    Case, CaseError, Drive, Errors, Fluid, Inclined, SolCx, couette, coupled_cell,
    inclined_pure_shear, inclined_shear, poiseuille, solcx, solvi, start, steady_vortex,
    steady_vortex_without_particles,
};
use crate::scene::{SceneError, SceneSource, presets};
use crate::sim::Run;
use crate::verify::{Bound, Check};

/// All trials, by group.
pub fn all() -> Result<Vec<Trial>, CaseError> {
    let mut out = Vec::new();
    contrasts(&mut out)?;
    cosserat(&mut out);
    layers(&mut out);
    compressible(&mut out);
    boundaries(&mut out)?;
    free_surfaces(&mut out);
    time_steps(&mut out)?;
    particles(&mut out)?;
    units(&mut out);
    super::round::trials(&mut out)?;
    super::grains::trials(&mut out);
    super::solids::trials(&mut out);
    super::voids::trials(&mut out);
    Ok(out
        .into_iter()
        .map(|t| {
            let quick = !SLOW.iter().any(|s| t.name.contains(s));
            t.quick_if(quick)
        })
        .collect())
}

/// Parts of names of trials that are not in the quick battery, because it contains harder trials of
/// the same kind.
const SLOW: [&str; 22] = [
    ", 1e0",
    ", 1e4",
    ", 1e-4",
    "1e3",
    "1e2 ",
    "1e4 ",
    "eta_s/eta = 1e0",
    "eta_s/eta = 1e-2",
    "R = 1e-3",
    "eta_c/eta = 1e4",
    "B = 1 ",
    "B = 1e4",
    "falls on a block",
    "500 steps",
    "400 per",
    "graded",
    "5 cells a step",
    "0.001 cells",
    "Poiseuille",
    "lengths x 1e30",
    "B = 1e-2",
    "a cell, 1e",
];

/// A trial from a scene text. It is in the quick battery, and its drift is checked.
pub(super) fn trial(
    group: &'static str,
    name: impl Into<String>,
    text: String,
    steps: u64,
) -> Trial {
    let name = name.into();
    Trial {
        group,
        scene: SceneSource::new(name.clone(), text),
        name,
        steps,
        drifts: false,
        expect: None,
        quick: true,
    }
}

impl Trial {
    /// Excludes the trial from the quick battery.
    fn long(mut self) -> Self {
        self.quick = false;
        self
    }

    /// Excludes the check of the drift.
    pub(super) fn drifting(mut self) -> Self {
        self.drifts = true;
        self
    }

    /// Adds checks of the finished run.
    pub(super) fn expecting(
        mut self,
        f: impl Fn(&dyn Run) -> Result<Vec<Check>, CaseError> + Send + Sync + 'static,
    ) -> Self {
        self.expect = Some(Box::new(f) as Expectation);
        self
    }

    /// Excludes the trial from the quick battery unless `quick`.
    fn quick_if(mut self, quick: bool) -> Self {
        self.quick &= quick;
        self
    }

    /// A trial whose initial velocity error against an exact solution must be at most `most`.
    fn exact(
        group: &'static str,
        name: String,
        case: Case,
        cells: u32,
        most: f64,
    ) -> Result<Self, SceneError> {
        let scene = case.scene.with_sets(&[format!("accuracy.cells={cells}")])?;
        let mut out = trial(group, name, String::new(), 2).drifting();
        out.scene = scene;
        Ok(out.expecting(move |_| {
            let e = case.errors(cells, &[])?;
            Ok(vec![Check::new("velocity error", e.velocity, Bound::AtMost(most))])
        }))
    }
}

/// A scene of a unit box; `rest` is appended to the `[time]` table.
fn unit_box(name: &str, cells: u32, end: f64, rest: &str) -> String {
    format!(
        "schema = 1\nname = \"{name}\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 1]\n\
         [accuracy]\ncells = {cells}\nplacement = \"jittered\"\n[time]\nend = {end:?}\n{rest}"
    )
}

/// A circular drop in a fluid of viscosity 1; `more` is added to its material.
fn drop_scene(density: f64, viscosity: f64, more: &str, radius: f64) -> String {
    unit_box(
        "drop",
        12,
        1e9,
        &format!(
            "[materials.drop]\ndensity = {density:e}\nshear_viscosity = {viscosity:e}\n{more}\n\
             [materials.around]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"around\"\n\
             [[regions]]\nmaterial = \"drop\"\nshape.circle = {{ centre = [0.47, 0.55], radius = {radius:?} }}\n"
        ),
    )
}

/// Large contrasts of viscosity and density.
fn contrasts(out: &mut Vec<Trial>) -> Result<(), CaseError> {
    const GROUP: &str = "viscosity and density contrast";
    for power in [0, 4, 8, -4, -8] {
        let contrast = 10f64.powi(power);
        let label = format!("1e{power}");
        let jump = |jump| solcx(SolCx { contrast, jump }, Drive::BodyForce);
        out.push(Trial::exact(
            GROUP,
            format!("jump on a mesh line, {label}"),
            jump(0.5)?,
            16,
            0.01,
        )?);
        out.push(Trial::exact(GROUP, format!("jump inside a cell, {label}"), jump(0.5)?, 17, 0.3)?);
        let layers = Inclined { degrees: 30.0, contrast };
        out.push(Trial::exact(
            GROUP,
            format!("inclined layers, shear, {label}"),
            inclined_shear(layers),
            16,
            0.1,
        )?);
        out.push(Trial::exact(
            GROUP,
            format!("inclined layers, stretched, {label}"),
            inclined_pure_shear(layers),
            16,
            0.3,
        )?);
        out.push(Trial::exact(GROUP, format!("inclusion, {label}"), solvi(contrast)?, 16, 0.2)?);
        let sheet = |shape: &str| {
            unit_box(
                "sheet",
                12,
                1e9,
                &format!(
                    "[materials.sheet]\nshear_viscosity = {contrast:e}\ndensity = 1\n\
                     [materials.around]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"around\"\n\
                     [[regions]]\nmaterial = \"sheet\"\nshape.where = \"{shape}\"\n"
                ),
            )
        };
        for (name, half) in [("half a cell", 0.021), ("a cell", 0.042)] {
            let shape = format!("abs(y - 0.3*x - 0.4) < {half}");
            let name = format!("sheet of {name}, {label}");
            out.push(trial(GROUP, name, sheet(&shape), 5).drifting());
        }
        out.push(
            trial(
                GROUP,
                format!("drop of a fifth of a cell, {label}"),
                drop_scene(1.0, contrast, "", 0.016),
                5,
            )
            .drifting(),
        );
        out.push(trial(
            GROUP,
            format!("falling drop, {label}"),
            drop_scene(1.0, contrast, "", 0.2),
            20,
        ));
    }
    out.push(trial(GROUP, "density 1e6 in density 0", drop_scene(1e6, 10.0, "", 0.2), 20));
    out.push(trial(GROUP, "density 1e-6 in density 0", drop_scene(1e-6, 10.0, "", 0.2), 20));
    Ok(())
}

/// A drop of Cosserat fluid.
fn cosserat_drop(coupling: f64, length: f64) -> String {
    let more = format!("coupling_viscosity = {coupling:e}\ninternal_length = {length:e}");
    drop_scene(1.0, 10.0, &more, 0.25)
}

/// Limits of the internal length and of the coupling viscosity.
fn cosserat(out: &mut Vec<Trial>) {
    const GROUP: &str = "Cosserat limits";
    for power in [-9, -3, 3, 6] {
        let length = 10f64.powi(power);
        out.push(trial(GROUP, format!("drop with R = 1e{power}"), cosserat_drop(10.0, length), 10));
    }
    for power in [-6, 4, 8] {
        let coupling = 10.0 * 10f64.powi(power);
        out.push(trial(
            GROUP,
            format!("drop with eta_c/eta = 1e{power}"),
            cosserat_drop(coupling, 0.1),
            10,
        ));
    }
    out.push(trial(GROUP, "drop with eta_c = 0", cosserat_drop(0.0, 0.1), 10));
    // With free rotation at walls the solution is the classical one for any R; here R is small.
    let fluid = Fluid { shear: 1.0, coupling: 1.0, internal_length: 1e-6 };
    let text = couette(fluid, 1.0).scene.text().replace(", rotation = 0", "");
    out.push(trial(GROUP, "R -> 0 between walls is classical", text, 1).expecting(|run| {
        let speed = run.velocity_at([0.1, 0.5])[0] - run.velocity_at([0.1, -0.5])[0];
        Ok(vec![Check::new("speed", speed, Bound::Within(1.0, 1e-6))])
    }));
    let fluid = Fluid { shear: 1.0, coupling: 3.0, internal_length: 1e6 };
    let text = couette(fluid, 1.0).scene.text().to_string();
    out.push(trial(GROUP, "R = 1e6 between walls: eta/(eta + eta_c)", text, 1).expecting(|run| {
        let speed = run.velocity_at([0.1, 0.5])[0] - run.velocity_at([0.1, -0.5])[0];
        Ok(vec![Check::new("speed", speed, Bound::Within(0.25, 1e-6))])
    }));
    // The couple-stress limit: w must equal the spin, and the elements must not lock.
    const M: f64 = 0.1;
    for power in [2, 4, 8] {
        let coupling = 10f64.powi(power);
        let case = move || {
            let internal_length = (M / (2.0 * coupling)).sqrt();
            let fluid = Fluid { shear: 1.0, coupling, internal_length };
            [coupled_cell(fluid, 1, 1), couette(fluid, 1.0), poiseuille(fluid, 1.0)]
        };
        let label = format!("eta_c/eta = 1e{power} at fixed M");
        for (k, name) in ["coupled cell", "Couette", "Poiseuille"].into_iter().enumerate() {
            let text =
                case()[k].scene.text().replace("end = 1\n", "end = 1\n[accuracy]\ncells = 16\n");
            out.push(trial(GROUP, format!("{name}, {label}"), text, 1).expecting(move |_| {
                let case = &case()[k];
                let (coarse, fine) = (case.errors(16, &[])?, case.errors(32, &[])?);
                let rate = |f: fn(&Errors) -> f64| (f(&coarse) / f(&fine)).log2();
                Ok(vec![
                    Check::new("velocity error", fine.velocity, Bound::AtMost(1e-4)),
                    Check::new("rate of velocity", rate(|e| e.velocity), Bound::AtLeast(2.8)),
                    Check::new("rotation error", fine.rotation, Bound::AtMost(1e-3)),
                ])
            }));
        }
        let more = format!("coupling_viscosity = {:e}\ncouple_viscosity = {M}", 10.0 * coupling);
        out.push(trial(GROUP, format!("drop, {label}"), drop_scene(1.0, 10.0, &more, 0.25), 10));
    }
    // In this limit the coupled cell flows like a fluid of viscosity eta + M K^2/4.
    let coupling = 1e8;
    let fluid = Fluid { shear: 1.0, coupling, internal_length: (M / (2.0 * coupling)).sqrt() };
    let stirred = "sin(pi*x) * cos(pi*y)\"\ny = \"-cos(pi*x) * sin(pi*y)\"\n";
    let text = coupled_cell(fluid, 1, 1)
        .scene
        .text()
        .replace("end = 1\n", "end = 1\n[accuracy]\ncells = 16\n");
    let (head, tail) = (text.find("x = \"").unwrap_or(0), text.find("[boundaries]").unwrap_or(0));
    let text = format!("{}x = \"{stirred}{}", &text[..head], &text[tail..]);
    out.push(trial(GROUP, "couple-stress limit: viscosity eta + M K^2/4", text, 1).expecting(
        |run| {
            let k2 = 2.0 * std::f64::consts::PI.powi(2);
            let eta = 1.0 / (k2 * run.velocity_at([0.5, 0.0])[0]);
            let expected = 1.0 + 0.25 * M * k2;
            Ok(vec![Check::new("viscosity", eta, Bound::Within(expected, 1e-4 * expected))])
        },
    ));
}

/// A sheared box of layered fluid, periodic in x.
fn sheared(name: &str, ratio: f64, director: &str, more: &str) -> String {
    format!(
        "schema = 1\nname = \"{name}\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\ncells = 8\n\
         placement = \"jittered\"\n[time]\nend = 1e9\nmax_step = 0.05\n[materials.fluid]\nshear_viscosity = 1\n\
         layer_viscosity = {ratio:e}\n{more}\n[[regions]]\nmaterial = \"fluid\"\n\
         director = {director}\n[boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n\
         bottom.kind = \"no_slip\"\ntop = {{ velocity_x = 1, velocity_y = 0 }}\n"
    )
}

/// Layered fluids with various directors and viscosity ratios.
fn layers(out: &mut Vec<Trial>) {
    const GROUP: &str = "layers";
    let angle = |text: &str| format!("{{ angle_degrees = \"{text}\" }}");
    for power in [0, -2, -6] {
        let ratio = 10f64.powi(power);
        let label = format!("eta_s/eta = 1e{power}");
        for (name, director) in [
            ("random", "\"random\"".to_string()),
            ("0 degrees", angle("0")),
            ("45 degrees", angle("45")),
            ("90 degrees", angle("90")),
            ("two populations at right angles", angle("90 * (sin(40*pi*x) * sin(40*pi*y) > 0)")),
        ] {
            out.push(trial(
                GROUP,
                format!("{name}, {label}"),
                sheared("layers", ratio, &director, ""),
                20,
            ));
        }
        let cosserat = "coupling_viscosity = 1\ninternal_length = 0.2";
        out.push(trial(
            GROUP,
            format!("random with Cosserat rotation, {label}"),
            sheared("layers", ratio, "\"random\"", cosserat),
            20,
        ));
    }
    // Viscosity of aligned layers in plane shear: eta_s + (eta - eta_s) sin^2(2 theta).
    for (degrees, expected) in [(0.0, 1e-2), (45.0, 1.0), (90.0, 1e-2)] {
        let text = sheared("aligned", 1e-2, &angle(&format!("{degrees}")), "");
        out.push(
            trial(GROUP, format!("viscosity of layers at {degrees} degrees"), text, 0).expecting(
                move |run| {
                    // Dissipation per volume over the square of the shear rate, which is 1.
                    let eta = run.row().dissipation;
                    Ok(vec![Check::new("viscosity", eta, Bound::Within(expected, 1e-9))])
                },
            ),
        );
    }
}

/// Finite bulk viscosity.
fn compressible(out: &mut Vec<Trial>) {
    const GROUP: &str = "bulk viscosity";
    for (label, bulk) in [("1e-2", 1e-2), ("1", 1.0), ("1e4", 1e4), ("1e10", 1e10)] {
        let side = "{ velocity_x = \"-0.3*x\", velocity_y = \"-0.1*y\" }";
        let text = format!(
            "schema = 1\nname = \"squeeze\"\n[domain]\nx = [-1, 1]\ny = [-1, 1]\n[accuracy]\n\
             cells = 6\n[time]\nend = 1e9\nmax_step = 0.02\n[materials.a]\nshear_viscosity = 1\n\
             bulk_viscosity = {bulk:e}\n[[regions]]\nmaterial = \"a\"\n[boundaries]\n\
             left = {side}\nright = {side}\nbottom = {side}\ntop = {side}\n\
             [dye]\nmarks = [{{ from = [-1, 0], to = [1, 0], width = 4 }}]\n"
        );
        out.push(
            trial(GROUP, format!("squeezed box, B = {label} eta"), text, 10).drifting().expecting(
                move |run| {
                    // What enters is not marked.
                    let p = run.particles();
                    let marks = p.mark.iter().flatten();
                    let own = p.volume.iter().zip(marks).filter(|(_, mark)| **mark);
                    let volume = own.map(|(v, _)| v).sum::<f64>() * run.plan().units.volume();
                    let squeezed = 4.0 * (-0.4 * run.row().time).exp();
                    Ok(vec![Check::new("volume", volume, Bound::Within(squeezed, 1e-6))])
                },
            ),
        );
        out.push(
            trial(
                GROUP,
                format!("falling compressible drop, B = {label}"),
                drop_scene(1.0, 1.0, &format!("bulk_viscosity = {bulk:e}"), 0.2),
                10,
            )
            .drifting(),
        );
    }
}

/// Unusual boundary conditions, meshes and obstacles.
fn boundaries(out: &mut Vec<Trial>) -> Result<(), CaseError> {
    const GROUP: &str = "boundaries and meshes";
    let fluid = "[materials.fluid]\nshear_viscosity = 1\n[[regions]]\nmaterial = \"fluid\"\n";
    let stir =
        "[body_force]\nx = \"sin(2*pi*x) * cos(2*pi*y)\"\ny = \"-cos(2*pi*x) * sin(2*pi*y)\"\n";
    let periodic =
        ["left", "right", "bottom", "top"].map(|s| format!("{s}.kind = \"periodic\"\n")).concat();
    out.push(
        trial(GROUP, "closed box, no load", unit_box("closed", 8, 1e9, fluid), 0).expecting(
            |run| Ok(vec![Check::new("speed", run.row().max_speed, Bound::AtMost(1e-12))]),
        ),
    );
    out.push(trial(
        GROUP,
        "periodic in both directions",
        unit_box("periodic", 8, 1e9, &format!("{fluid}{stir}[boundaries]\n{periodic}")),
        20,
    ));
    let tractions = "[boundaries]\nleft.kind = \"periodic\"\nright.kind = \"periodic\"\n\
                     bottom = { kind = \"open\", traction_x = -1, velocity_y = 0 }\n\
                     top = { kind = \"open\", traction_x = 1, velocity_y = 0 }\n";
    out.push(
        trial(
            GROUP,
            "driven by tractions only",
            unit_box("tractions", 8, 1e9, &format!("{fluid}{tractions}")),
            20,
        )
        .expecting(|run| {
            let rate = run.velocity_at([0.5, 1.0])[0] - run.velocity_at([0.5, 0.0])[0];
            Ok(vec![Check::new("shear rate", rate, Bound::Within(1.0, 1e-9))])
        }),
    );
    for (name, x, y, cells, scale) in [
        ("one cell wide", "[0, 0.125]", "[0, 1]", 8, 1.0),
        ("one cell high", "[0, 1]", "[0, 0.125]", 8, 1.0),
        ("a single cell", "[0, 1]", "[0, 1]", 1, 1.0),
        ("aspect ratio 100", "[0, 100]", "[0, 1]", 2, 1.0),
    ] {
        let text = format!(
            "schema = 1\nname = \"narrow\"\ngravity = [0, -1]\n[domain]\nx = {x}\ny = {y}\n\
             length_scale = {scale}\n[accuracy]\ncells = {cells}\n[time]\nend = 1e9\n\
             [materials.heavy]\ndensity = 1\nshear_viscosity = 1\n[materials.light]\n\
             shear_viscosity = 1e-3\n[[regions]]\nmaterial = \"light\"\n[[regions]]\n\
             material = \"heavy\"\nshape.where = \"x < 0.06 || (x > 0.3 && x < 0.6)\"\n"
        );
        out.push(trial(GROUP, name, text, 10).drifting());
    }
    let lines =
        "[mesh]\ngrading = [{ towards.x = 0.3, factor = 32 }, { towards.y = 0.6, factor = 32 }]\n";
    out.push(trial(
        GROUP,
        "graded by a factor of 32",
        drop_scene(1.0, 100.0, "", 0.2).replace("[accuracy]", &format!("{lines}[accuracy]")),
        10,
    ));
    let thin = "[mesh]\nlines_x = [0.5, 0.501]\nlines_y = [0.5, 0.501]\n";
    out.push(trial(
        GROUP,
        "cells of aspect ratio 80 beside others",
        drop_scene(1.0, 100.0, "", 0.2).replace("[accuracy]", &format!("{thin}[accuracy]")),
        10,
    ));
    let solid = "[[blocks]]\nname = \"step\"\nx = [0.25, 0.5]\ny = [0.1, 0.35]\n\
                 [[walls]]\nname = \"sill\"\nkind = \"no_slip\"\nfrom = [0.6, 0.25]\nto = [0.9, 0.25]\n";
    let text = drop_scene(1.0, 10.0, "", 0.19) + solid;
    out.push(trial(GROUP, "a drop falls on a block and a wall", text, 100));
    let mut silo = trial(GROUP, "silo at contrast 1e6, R = 10/3 a", String::new(), 30).long();
    silo.scene = presets::find("silo")?.with_sets(&[
        "accuracy.cells=4".into(),
        "contrast=1e6".into(),
        "alpha=10/3".into(),
    ])?;
    out.push(silo);
    Ok(())
}

/// Heavy fluids with sloping surfaces under thin air, with the rule for them.
fn free_surfaces(out: &mut Vec<Trial>) {
    const GROUP: &str = "free surfaces";
    // A box of 4 x 1.5 m with no slip on sides and floor.
    let scene = |contrast: f64, mud: &str| {
        format!(
            "schema = 1\nname = \"mud\"\ngravity = [0, -10]\n[domain]\nx = [0, 4]\ny = [0, 1.5]\n\
             length_scale = 1\n[accuracy]\ncells = 8\nplacement = \"jittered\"\n[time]\nend = 5\n[boundaries]\n\
             left.kind = \"no_slip\"\nright.kind = \"no_slip\"\nbottom.kind = \"no_slip\"\n\
             [materials.mud]\ndensity = 1000\nshear_viscosity = 1000\n\
             [materials.air]\nshear_viscosity = \"1000/{contrast:e}\"\n\
             [[regions]]\nmaterial = \"air\"\n[[regions]]\nmaterial = \"mud\"\n{mud}\n"
        )
    };
    let mut add = |name: String, text: String| {
        let source = SceneSource::new(name.clone(), text.clone());
        out.push(trial(GROUP, name, text, 400).drifting().expecting(move |run| {
            let lost = start(&source)?.row().potential_energy - run.row().potential_energy;
            let error = (lost - run.row().dissipated).abs() / lost;
            Ok(vec![Check::new("energy lost and dissipated", error, Bound::AtMost(0.05))])
        }));
    };
    for power in [3, 4, 6, 8, 9] {
        let mud = "shape.rectangle = { x = [0, 1], y = [0, 1] }";
        add(format!("a block slumps, contrast 1e{power}"), scene(10f64.powi(power), mud));
    }
    let dome = "shape.circle = { centre = [2.03, 0], radius = 0.8 }";
    add("a dome spreads, contrast 1e6".into(), scene(1e6, dome));
    let tilted = "shape.where = \"y < 0.7 + 0.3*(x - 2)\"";
    add("a tilted layer levels, contrast 1e6".into(), scene(1e6, tilted));
    let drop = "shape.circle = { centre = [2.03, 1.02], radius = 0.3 }\n\
                [[blocks]]\nname = \"ledge\"\nx = [1.5, 2.25]\ny = [0.5, 0.75]";
    add("a drop on a ledge, contrast 1e6".into(), scene(1e6, drop));
}

/// Very small and very large time steps, and many steps.
fn time_steps(out: &mut Vec<Trial>) -> Result<(), CaseError> {
    const GROUP: &str = "time steps";
    for (name, courant, steps) in [("0.001", 1e-3, 20), ("5", 5.0, 40), ("50", 50.0, 40)] {
        let text = drop_scene(1.0, 10.0, "", 0.2)
            .replace("end = 1000000000.0", &format!("end = 1e9\ncourant = {courant}\nstrain = 10"));
        out.push(trial(GROUP, format!("falling drop, {name} cells a step"), text, steps));
    }
    for (contrast, level) in
        [("1", "0.52"), ("1e3", "0.52"), ("1e6", "0.52"), ("1e6", "0.51"), ("1e6", "0.58")]
    {
        let name = format!(
            "heavy fluid at rest up to {level}, 60 steps of its relaxation time, contrast {contrast}"
        );
        let mut long = trial(GROUP, name, String::new(), 60).long();
        long.scene = presets::find("hydrostatic")?.with_sets(&[
            "accuracy.cells=12".into(),
            format!("level={level}"),
            format!("contrast={contrast}"),
            "time.end=1e9".into(),
            "time.max_step=0.01".into(),
        ])?;
        // rho g a^2 / eta = 100
        out.push(long.expecting(|run| {
            Ok(vec![Check::new("speed", run.row().max_speed / 100.0, Bound::AtMost(1e-6))])
        }));
    }
    for contrast in ["1", "1e3", "1e6"] {
        let mut rest = trial(
            GROUP,
            format!("heavy fluid at rest, one giant step, contrast {contrast}"),
            String::new(),
            3,
        );
        rest.scene = presets::find("hydrostatic")?.with_sets(&[
            "accuracy.cells=12".into(),
            "level=0.52".into(),
            format!("contrast={contrast}"),
            "time.end=1e9".into(),
            "time.max_step=1e9".into(),
        ])?;
        out.push(rest.expecting(|run| {
            // rho g a^2 / eta
            Ok(vec![Check::new("speed", run.row().max_speed / 100.0, Bound::AtMost(1e-6))])
        }));
    }
    let endless = |case: Case| {
        let text = case.scene.text().replace("end = 0.1", "end = 1e9");
        text.replace("[accuracy]", "[accuracy]\ncells = 12")
    };
    out.push(trial(GROUP, "vortex of carried density, 500 steps", endless(steady_vortex()), 500));
    let long = endless(steady_vortex_without_particles());
    out.push(trial(GROUP, "steady vortex, 500 steps", long.clone(), 500));
    out.push(trial(GROUP, "steady vortex, 10,000 steps", long, 10_000).long());
    Ok(())
}

/// Few and many particles, particles on mesh lines, and strong deformation.
fn particles(out: &mut Vec<Trial>) -> Result<(), CaseError> {
    const GROUP: &str = "particles";
    for count in [1, 4, 400] {
        for placement in ["regular", "random"] {
            let text = drop_scene(1.0, 100.0, "", 0.2).replace(
                "placement = \"jittered\"",
                &format!("placement = \"{placement}\"\nparticles_per_cell = {count}"),
            );
            out.push(trial(GROUP, format!("{count} per cell, {placement}"), text, 20).drifting());
        }
    }
    // One particle per cell moves half a cell per step: onto faces, then onto corners of cells.
    let text = "schema = 1\nname = \"nodes\"\n[domain]\nx = [0, 1]\ny = [0, 1]\n[accuracy]\n\
                cells = 8\nparticles_per_cell = 1\n[time]\nend = 1e9\nmax_step = 0.0625\n\
                [materials.a]\nshear_viscosity = 1\n[materials.b]\nshear_viscosity = 1000\n\
                [[regions]]\nmaterial = \"a\"\n[[regions]]\nmaterial = \"b\"\n\
                shape.rectangle = { x = [0.25, 0.75], y = [0.25, 0.75] }\n[boundaries]\n\
                left.kind = \"periodic\"\nright.kind = \"periodic\"\n\
                bottom = { velocity_x = 1, velocity_y = 0 }\ntop = { velocity_x = 1, velocity_y = 0 }\n";
    out.push(trial(GROUP, "exactly on nodes, faces and corners", text.into(), 16));
    // A slug flows from one end to the other and back, because gravity changes its direction.
    let text = unit_box(
        "refill",
        8,
        120.0,
        "max_step = 0.5\n[materials.slug]\ndensity = 1\nshear_viscosity = 1\n[materials.air]\n\
         shear_viscosity = 0.01\nbackground = true\n[[regions]]\nmaterial = \"slug\"\n\
         shape.rectangle = { x = [0, 1], y = [0, 0.4] }\n\
         [[schedule]]\ntime = 1\nset = { \"gravity[1]\" = 1, \"gravity[0]\" = 0.05 }\n\
         [[schedule]]\ntime = 60\nset = { \"gravity[1]\" = -1, \"gravity[0]\" = 0 }\n",
    );
    out.push(trial(GROUP, "a region empties and refills", text, 100_000).long());
    let jet = "schema = 1\nname = \"jet\"\ngravity = [0, -1]\n[domain]\nx = [0, 1]\ny = [0, 3]\n\
               length_scale = 1\n[accuracy]\ncells = 10\n[time]\nend = 1e9\n[materials.syrup]\n\
               density = 1\nshear_viscosity = 1\n[materials.air]\nshear_viscosity = 1e-4\n\
               background = true\n[[regions]]\nmaterial = \"syrup\"\n\
               shape.rectangle = { x = [0.2, 0.8], y = [2, 2.8] }\n[[walls]]\nname = \"left\"\n\
               from = [0.2, 2]\nto = [0.2, 2.8]\n[[walls]]\nname = \"right\"\nfrom = [0.8, 2]\n\
               to = [0.8, 2.8]\n[[walls]]\nname = \"floor_left\"\nfrom = [0.2, 2]\nto = [0.4, 2]\n\
               [[walls]]\nname = \"floor_right\"\nfrom = [0.6, 2]\nto = [0.8, 2]\n";
    out.push(trial(GROUP, "a jet stretches", jet.into(), 150).long());
    Ok(())
}

/// Scenes scaled by large factors.
fn units(out: &mut Vec<Trial>) {
    const GROUP: &str = "units";
    // Lengths are scaled by l, viscosities by m, times by t; speeds must scale accordingly.
    let scaled = |l: f64, m: f64, t: f64| {
        format!(
            "schema = 1\nname = \"units\"\ngravity = [0, {:e}]\n[domain]\nx = [0, {l:e}]\ny = [0, {l:e}]\n\
             [accuracy]\ncells = 8\n[time]\nend = {:e}\n[materials.drop]\ndensity = {:e}\n\
             shear_viscosity = {:e}\ncoupling_viscosity = {:e}\ninternal_length = {:e}\n\
             [materials.around]\nshear_viscosity = {:e}\n[[regions]]\nmaterial = \"around\"\n\
             [[regions]]\nmaterial = \"drop\"\nshape.circle = {{ centre = [{:e}, {:e}], radius = {:e} }}\n",
            -l / (t * t),
            1e9 * t,
            m * t / (l * l),
            10.0 * m,
            10.0 * m,
            0.1 * l,
            m,
            0.47 * l,
            0.55 * l,
            0.2 * l
        )
    };
    for (name, l, m, t) in [
        ("lengths x 1e30", 1e30, 1.0, 1.0),
        ("lengths x 1e-30", 1e-30, 1.0, 1.0),
        ("viscosities x 1e30", 1.0, 1e30, 1.0),
        ("times x 1e-30", 1.0, 1.0, 1e-30),
    ] {
        let reference = scaled(1.0, 1.0, 1.0);
        out.push(trial(GROUP, name, scaled(l, m, t), 5).expecting(move |run| {
            let source = SceneSource::new("reference", reference.clone());
            let plan = crate::plan::resolve(&crate::scene::parse(&source)?)?;
            let mut other = crate::sim::start(std::sync::Arc::new(plan))?;
            for _ in 0..5 {
                other.step()?;
            }
            let ratio = run.row().max_speed / (l / t) / other.row().max_speed;
            Ok(vec![Check::new("scaled speed", ratio, Bound::Within(1.0, 1e-9))])
        }));
    }
}
