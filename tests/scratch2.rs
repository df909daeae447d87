mod common;
#[path = "common/scenes.rs"]
mod scenes;
use vesicle::methods::deformable::*;
#[test]
fn rest() {
    let v = scenes::menger(2);
    for speed in [0.4] {
        let p = DeformableParams {
            iso: 0.4,
            rigidity: 0.05,
            stiffness: 0.001,
            damping: speed,
            ..DeformableParams::for_volume(&v)
        };
        let mut m =
            DeformableModel::new(&v, DeformableOptions { levels: 3, params: Some(p), ..Default::default() })
                .unwrap();
        let mut last: Vec<vesicle::math::Vec3> = vec![];
        loop {
            let r = m.step().unwrap();
            if r.phase == "level 0" && r.iteration % 40 < 2 && r.iteration > 300 {
                let pos = m.mesh().positions().to_vec();
                if last.len() == pos.len() {
                    let mut d: Vec<(f32, usize)> = m
                        .mesh()
                        .vertices()
                        .map(|v| (pos[v.index()].distance(last[v.index()]), v.index()))
                        .collect();
                    d.sort_by(|a, b| b.0.total_cmp(&a.0));
                    println!("{} e {:.1e} {:?}", r.iteration, r.residual, r.events);
                    for (x, i) in &d[..6] {
                        println!(
                            "   {x:.3} {i} {:?} val {}",
                            pos[*i],
                            m.mesh().ring(vesicle::mesh::VertexId(*i as u32)).valence()
                        );
                    }
                }
                last = pos;
            }
            if r.done || r.iteration > 1200 {
                println!("done {}", r.iteration);
                break;
            }
        }
    }
}
#[test]
fn head() {
    let bytes =
        std::fs::read("/work/shared/data/volumes/ct_head_visible_male/vismale_head_ct.nii.gz").unwrap();
    let v = vesicle::io::parse_volume(&bytes, None).unwrap();
    for (levels, delta) in [(3, 0.9)] {
        let edge = delta * 1.55 * (v.spacing().iter().product::<f64>()).cbrt();
        let p = DeformableParams { iso: 95.0, rigidity: 0.4, ..DeformableParams::for_volume(&v) };
        let t = std::time::Instant::now();
        let mc = vesicle::volume::marching_cubes(&v.grid(0).unwrap(), 95.0).unwrap();
        println!("mc {:.3} v {}", t.elapsed().as_secs_f64(), mc.positions.len());
        let t = std::time::Instant::now();
        let mut m = DeformableModel::new(
            &v,
            DeformableOptions { levels, edge: Some(edge), params: Some(p), ..Default::default() },
        )
        .unwrap();
        println!("setup {:.3}", t.elapsed().as_secs_f64());
        let mut phase = String::new();
        loop {
            let r = m.step().unwrap();
            if r.phase != phase || r.iteration % 100 == 0 {
                println!(
                    "{} {} v {} comp {} chi {} e {:.1e} t {:.2} x {}",
                    r.iteration,
                    r.phase,
                    r.vertices,
                    r.components,
                    r.euler,
                    r.residual,
                    t.elapsed().as_secs_f64(),
                    vesicle::mesh::count_crossings(&m.mesh().to_triangles())
                );
            }
            phase = r.phase;
            if r.done || r.iteration > 3000 {
                break;
            }
        }
    }
}
#[test]
fn levels() {
    let bytes =
        std::fs::read("/work/shared/data/volumes/ct_head_visible_male/vismale_head_ct.nii.gz").unwrap();
    let v = vesicle::io::parse_volume(&bytes, None).unwrap();
    println!("dims {:?} {:?}", v.dims(), v.range());
    for l in v.pyramid(4, 1.7320508).unwrap() {
        let g = l.grid(0).unwrap();
        let n = g.values.iter().filter(|x| **x > 95.0).count();
        let m = vesicle::volume::marching_cubes(&g, 95.0).unwrap();
        let me = vesicle::mesh::measure(&m);
        println!(
            "L {:?} {:?} over {} = {:.4} max {:?} mc comps {} chi {} v {}",
            l.dims(),
            l.spacing(),
            n,
            n as f64 / g.values.len() as f64,
            g.values.iter().cloned().fold(0.0, f32::max),
            me.components,
            me.euler,
            me.vertices
        );
    }
    for (levels, rigidity) in [(2, 0.4), (1, 0.4), (2, 0.2), (3, 0.1)] {
        let p = DeformableParams { iso: 95.0, rigidity, ..DeformableParams::for_volume(&v) };
        let t = std::time::Instant::now();
        let mut m =
            DeformableModel::new(&v, DeformableOptions { levels, params: Some(p), ..Default::default() })
                .unwrap();
        let mut phase = String::new();
        println!("L levels {levels} rigidity {rigidity}");
        loop {
            let r = m.step().unwrap();
            if r.phase != phase || r.iteration % 100 == 0 {
                println!(
                    "L {} {} v {} comp {} chi {} e {:.1e} t {:.2} x {}",
                    r.iteration,
                    r.phase,
                    r.vertices,
                    r.components,
                    r.euler,
                    r.residual,
                    t.elapsed().as_secs_f64(),
                    vesicle::mesh::count_crossings(&m.mesh().to_triangles())
                );
            }
            phase = r.phase;
            if r.done || r.iteration > 1000 || r.vertices == 0 {
                break;
            }
        }
    }
}
#[test]
fn cycle() {
    let bytes =
        std::fs::read("/work/shared/data/volumes/ct_head_visible_male/vismale_head_ct.nii.gz").unwrap();
    let v = vesicle::io::parse_volume(&bytes, None).unwrap();
    let v = v.pyramid(3, 1.7320508).unwrap().pop().unwrap();
    let p = DeformableParams { iso: 95.0, rigidity: 0.4, ..DeformableParams::for_volume(&v) };
    let mut m =
        DeformableModel::new(&v, DeformableOptions { levels: 0, params: Some(p), ..Default::default() })
            .unwrap();
    let mut hist: Vec<Vec<vesicle::math::Vec3>> = vec![];
    for it in 0..420 {
        let r = m.step().unwrap();
        if it >= 400 {
            if it < 415 {
                hist.push(m.mesh().positions().to_vec());
                continue;
            }
            hist.push(m.mesh().positions().to_vec());
            println!("C {} e {:.1e} {:?}", r.iteration, r.residual, r.events);
        }
    }
    let n = hist.iter().map(|h| h.len()).min().unwrap();
    let mut fast: Vec<(f32, usize)> =
        (0..n).map(|i| (hist[18][i].distance(hist[19][i]), i)).filter(|x| x.0 < 1.0).collect();
    fast.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!(
        "C counts >.05: {} >.01: {} of {n}",
        fast.iter().filter(|f| f.0 > 0.05).count(),
        fast.iter().filter(|f| f.0 > 0.01).count()
    );
    let q = m.surface();
    let me = vesicle::mesh::measure(&q);
    println!(
        "C area {:.0} vol {:.0} minangle {:.1} edge {:.2} {:.2} {:.2} comps {} chi {} x {}",
        me.area,
        me.volume,
        me.min_angle_degrees,
        me.edge_min,
        me.edge_mean,
        me.edge_max,
        me.components,
        me.euler,
        vesicle::mesh::count_crossings(&q)
    );
}
