//! mjtrace SECONDS SEED NETEM : csv
use mmt_lab::world::{World, WorldConfig};
use mmt_server::io::plant_link::LockStep;
use mmt_shared::time::{TICK, Time};
fn main() {
    let a: Vec<String> = std::env::args().skip(1).collect();
    let netem = a[2].parse().unwrap();
    let mut config = WorldConfig::over(netem);
    let linked = a.get(3).is_some();
    config.slave.plant.link = linked;
    let config = config.seeded(a[1].parse().unwrap());
    let mut world = World::try_new(&config).unwrap();
    let mut plant = linked.then(|| {
        let mut p = LockStep::start("127.0.0.1:0".parse().unwrap()).unwrap();
        eprintln!("plant: {}", p.address());
        while !p.wait() {}
        p
    });
    println!("t,fs,fsx,fsy,fm,fmx,fmy,sh,sc,mc,tx,ty,ox,oy,oa,mx,my,ma,px,py,pa,m,b,c,hm,hb,hc,v,stick,upd");
    for _ in 0..(a[0].parse::<f64>().unwrap() * 1000.0) as u64 {
        if let (Some(plant), Some(command)) = (&mut plant, world.plant_command()) {
            let answer = plant.exchange(&command).unwrap();
            world.answer_of_plant(answer);
        }
        let tick = world.step();
        let t = tick.now.saturating_since(Time::ZERO + TICK).as_secs_f64();
        let Some(s) = tick.slave else { continue };
        let m = world.master().model().state();
        let sl = world.slave();
        let e = sl.estimate();
        let o = sl.observer().pose();
        let fm = s.f_m.unwrap_or_default();
        let f = s.true_force;
        println!("{t:.3},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{},{},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5},{:.5},{:.4},{:.4},{:.4},{:.4},{:.4},{:.4},{:.5},{},{}",
            f.norm(), f.x, f.y, if s.f_m.is_some() {fm.norm()} else {f64::NAN}, fm.x, fm.y, s.f_shadow.norm(), u8::from(s.in_contact), u8::from(tick.master.rendered.in_contact()),
            s.tool.x, s.tool.y, o.position.x, o.position.y, o.angle, m.pose.position.x, m.pose.position.y, m.pose.angle, s.truth.position.x, s.truth.position.y, s.truth.angle,
            e.m, e.b, e.c, m.params.m(), m.params.b(), m.params.c(), e.speed, u8::from(e.sticking), s.update.map_or("-".into(), |u| format!("{:?}", u.cause)));
    }
}
