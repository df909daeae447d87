mod common;
#[path = "common/scenes.rs"]
mod scenes;
use vesicle::mesh::*;
use vesicle::methods::deformable::*;
fn run(name: &str, volume: &vesicle::volume::Volume, options: DeformableOptions, max: usize, each: usize) {
    let t = std::time::Instant::now();
    let mut model = DeformableModel::new(volume, options).unwrap();
    println!(
        "== {name}: start {} vertices chi {} delta {} crossings {}",
        model.mesh().vertex_count(),
        model.mesh().euler(),
        model.delta(),
        count_crossings(&model.mesh().to_triangles())
    );
    assert_eq!(model.mesh().check(), Ok(()));
    let mut phase = String::new();
    let mut worst = 0;
    let mut withx = 0;
    let mut tsum = 0.0;
    for i in 0..max {
        let t = std::time::Instant::now();
        let r = model.step().unwrap();
        tsum += t.elapsed().as_secs_f64();
        assert_eq!(model.mesh().check(), Ok(()));
        let x = if each == 0 { 0 } else { count_crossings(&model.mesh().to_triangles()) };
        worst = worst.max(x);
        if x > 0 {
            withx += 1
        }
        if r.done || r.phase != phase {
            println!(
                "{:4} {} v {} comp {} chi {} e {:.2e} x {}",
                r.iteration, r.phase, r.vertices, r.components, r.euler, r.residual, x
            );
        }
        phase = r.phase.clone();
        if r.done {
            break;
        }
    }
    println!(
        "steps {:.2}s all {:.2}s worst crossings {worst} in {withx} iterations",
        tsum,
        t.elapsed().as_secs_f64()
    );
}
#[test]
fn chain() {
    for (ma, tu) in [(16.0, 5.0), (16.0, 4.5), (18.0, 5.0), (18.0, 5.5)] {
        for margin in [2.0, 4.0] {
            for d in [1.4, 1.6, 1.8] {
                for damping in [0.3, 0.4, 0.5] {
                    let v = scenes::chain_of(ma, tu, margin);
                    let p = DeformableParams {
                        iso: 0.5,
                        rigidity: 0.1,
                        stiffness: 0.1,
                        damping,
                        ..DeformableParams::for_volume(&v)
                    };
                    let mut m = DeformableModel::new(
                        &v,
                        DeformableOptions { edge: Some(d * 1.55), params: Some(p), ..Default::default() },
                    )
                    .unwrap();
                    let mut ok_at = 0;
                    let mut r;
                    let mut worst = 0;
                    loop {
                        r = m.step().unwrap();
                        worst = worst.max(count_crossings(&m.mesh().to_triangles()));
                        let ok = r.components == 2 && r.euler == 0;
                        if !ok {
                            ok_at = 0
                        } else if ok_at == 0 {
                            ok_at = r.iteration
                        }
                        if r.done || r.iteration > 250 {
                            break;
                        }
                    }
                    println!(
                        "R {ma} r {tu} margin {margin} d {d} g {damping}: ok at {ok_at} done {} comps {} chi {} x {worst} v {}",
                        r.iteration, r.components, r.euler, r.vertices
                    );
                }
            }
        }
    }
}
#[test]
fn menger() {
    let v = scenes::menger(2);
    let p =
        DeformableParams { iso: 0.4, rigidity: 0.05, stiffness: 0.001, ..DeformableParams::for_volume(&v) };
    run(
        "menger2",
        &v,
        DeformableOptions { levels: 3, params: Some(p.clone()), ..Default::default() },
        1500,
        1,
    );
    let v = scenes::menger(3);
    run("menger3", &v, DeformableOptions { levels: 3, params: Some(p), ..Default::default() }, 1500, 1);
}
