// SPDX-License-Identifier: MIT
//! A game loop: things that move, what begins and ends to touch, and what a ray meets.
//!     cargo run --example game_loop
use jostle::{EndReason, Id, IdPair, ObjectFilter, ObjectOptions, Ray, World3f};

/// What the game knows of a thing; the world knows its box.
struct Thing {
    id: Id,
    name: &'static str,
    at: [f32; 3],
    speed: [f32; 3],
}

fn cube(at: [f32; 3]) -> [[f32; 3]; 2] {
    [at.map(|x| x - 0.5), at.map(|x| x + 0.5)]
}

fn main() -> Result<(), jostle::Error> {
    let mut world = World3f::new();
    // The floor never meets what else is static.
    let fixed = ObjectOptions {
        filter: ObjectFilter { is_static: true, ..Default::default() },
        ..Default::default()
    };
    let floor = world.add_with(&[[[-9.0, -1.0, -9.0], [9.0, 0.0, 9.0]]], &fixed)?[0];
    let mut things = Vec::new();
    for (name, at, speed) in
        [("player", [-4.0, 0.5, 0.0], [0.5, 0.0, 0.0]), ("crate", [0.0, 2.6, 0.0], [0.0, -0.5, 0.0])]
    {
        things.push(Thing { id: world.add(cube(at))?, name, at, speed });
    }
    // `Id::index` is small: what belongs to an object may lie in an array. Here a search will do.
    let names: Vec<(Id, &str)> =
        things.iter().map(|thing| (thing.id, thing.name)).chain([(floor, "floor")]).collect();
    let name = |id: Id| names.iter().find(|(known, _)| *known == id).map_or("?", |(_, name)| name);

    for frame in 0..20 {
        for thing in &mut things {
            thing.at = [0, 1, 2].map(|axis| thing.at[axis] + thing.speed[axis]);
            thing.at[1] = thing.at[1].max(0.5); // the ground
            world.move_to(thing.id, cube(thing.at))?;
        }
        world.update()?;
        for IdPair { a, b } in world.began() {
            println!("{frame}: {} touches {}", name(*a), name(*b));
        }
        for pair in world.ended().iter().filter(|pair| pair.reason == EndReason::MovedApart) {
            println!("{frame}: {} leaves {}", name(pair.a), name(pair.b));
        }
    }

    // Who is in front of the player? The ray begins inside its own box.
    let player = &things[0];
    let ray = Ray::new(player.at, [-1.0, 0.0, 0.0]);
    match world.ask().exclude(player.id).first(&ray)? {
        Some(hit) => println!("the player sees the {} after {}", name(hit.id), hit.at),
        None => println!("the player sees nothing"),
    }
    Ok(())
}
