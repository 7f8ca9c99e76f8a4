// SPDX-License-Identifier: MIT
#![cfg(feature = "world")]
mod common;

use common::{box_of, boxes, touch, Random};
use jostle::*;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed};
use std::sync::Arc;

type Ends<const D: usize> = [[f32; D]; 2];
#[derive(Clone)]
struct Object<const D: usize> {
    ends: Ends<D>,
    filter: ObjectFilter,
    enabled: bool,
}

/// A world from the definition: every pair of objects, in every frame.
#[derive(Clone, Default)]
struct Model<const D: usize> {
    objects: BTreeMap<Id, Object<D>>,
}
impl<const D: usize> Model<D> {
    /// By index, as the world has them.
    fn pairs(&self) -> BTreeSet<(u32, u32, Id, Id)> {
        let mut found = BTreeSet::new();
        let all: Vec<_> = self.objects.iter().collect();
        for (i, (a, first)) in all.iter().enumerate() {
            for (b, second) in &all[..i] {
                let (f, s) = (first.filter, second.filter);
                let wanted = f.mask & s.category != 0
                    && s.mask & f.category != 0
                    && (f.owner != s.owner || f.owner == u32::MAX)
                    && !(f.is_static && s.is_static);
                if wanted && first.enabled && second.enabled && touch(&first.ends, &second.ends) {
                    let (low, high) = if a.index() < b.index() { (**a, **b) } else { (**b, **a) };
                    found.insert((low.index(), high.index(), low, high));
                }
            }
        }
        found
    }
}

fn frames<const D: usize>(seed: u64, executor: &Executor) -> Vec<u8>
where
    f32: Coordinate<D>,
{
    let mut random = Random(seed);
    let mut world = World::<f32, D>::with_options(WorldOptions::new().executor(executor)).unwrap();
    let mut model = Model::<D>::default();
    let mut touched = BTreeSet::new();
    for frame in 0..40 {
        let before = model.clone();
        let mut changed = BTreeSet::new();
        for _ in 0..random.below(8) + usize::from(frame == 0) * 60 {
            let ends = box_of(&mut random, frame % 5 == 4, 4.0);
            let filter = ObjectFilter {
                category: 1 << random.below(3),
                mask: random.below(8) as u32,
                owner: [u32::MAX, 0, 1][random.below(3)],
                is_static: random.below(4) == 0,
            };
            let filter = if random.below(2) == 0 { ObjectFilter::default() } else { filter };
            let options = ObjectOptions { filter, user_data: random.bits(), ..Default::default() };
            let id = world.add_with(&[ends], &options).unwrap()[0];
            assert_eq!(world.user_data(id), Ok(options.user_data));
            model.objects.insert(id, Object { ends, filter, enabled: true });
            changed.insert(id);
        }
        let ids: Vec<Id> = before.objects.keys().copied().collect();
        for _ in 0..ids.len() / 2 {
            let id = ids[random.below(ids.len())];
            let object = match model.objects.get_mut(&id) {
                Some(object) => object,
                None => continue, // removed just now
            };
            changed.insert(id);
            match random.below(12) {
                0 => {
                    world.remove(id).unwrap();
                    model.objects.remove(&id);
                }
                1 => {
                    object.enabled = random.below(2) == 0;
                    world.set_enabled(id, object.enabled).unwrap();
                }
                2 => {
                    object.filter.mask = random.below(8) as u32;
                    world.set_filter(id, object.filter).unwrap();
                }
                _ => {
                    object.ends = box_of(&mut random, frame % 5 == 4, 4.0);
                    world.move_to(id, object.ends).unwrap();
                }
            }
        }
        world.update().unwrap();

        let pairs = model.pairs();
        let began: BTreeSet<_> = pairs.difference(&touched).copied().collect();
        let ended: BTreeSet<_> = touched.difference(&pairs).copied().collect();
        assert!(
            world
                .began()
                .iter()
                .map(|pair| (pair.a.index(), pair.b.index(), pair.a, pair.b))
                .eq(began.iter().copied()),
            "frame {frame}"
        );
        assert!(
            world
                .ended()
                .iter()
                .map(|pair| (pair.a.index(), pair.b.index(), pair.a, pair.b))
                .eq(ended.iter().copied()),
            "frame {frame}"
        );
        for pair in world.ended() {
            let gone = |id| !model.objects.contains_key(id);
            let disabled = |id| model.objects.get(id).map_or(false, |object| !object.enabled);
            let reason = if gone(&pair.a) || gone(&pair.b) {
                EndReason::Removed
            } else if disabled(&pair.a) || disabled(&pair.b) {
                EndReason::Disabled
            } else if touch(&model.objects[&pair.a].ends, &model.objects[&pair.b].ends) {
                EndReason::Filtered
            } else {
                EndReason::MovedApart
            };
            assert_eq!(pair.reason, reason);
        }
        // Of each pair that persists one object changed; all those are there.
        let by_index = |pairs: &BTreeSet<(u32, u32, Id, Id)>| -> BTreeSet<_> {
            pairs.iter().map(|pair| (pair.0, pair.1)).collect()
        };
        let persisted: BTreeSet<_> = world.persisted().iter().map(|pair| (pair.a, pair.b)).collect();
        let stayed: BTreeSet<_> = pairs.intersection(&touched).copied().collect();
        assert!(persisted.is_subset(&by_index(&stayed)));
        for (_, _, a, b) in stayed {
            let moved = |id| model.objects[id].ends != before.objects[id].ends;
            assert!(!(moved(&a) || moved(&b)) || persisted.contains(&(a.index(), b.index())));
        }
        let both: BTreeSet<_> = world.changed_pairs().iter().map(|pair| (pair.a, pair.b)).collect();
        assert_eq!(both, persisted.union(&by_index(&began)).copied().collect());
        assert_eq!(
            world.pairs().iter().map(|pair| (pair.a, pair.b)).collect::<BTreeSet<_>>(),
            by_index(&pairs)
        );

        assert_eq!((world.len(), world.is_empty()), (model.objects.len(), model.objects.is_empty()));
        for (id, object) in &model.objects {
            assert!(world.contains(*id) && id.index() < world.index_end());
            assert_eq!(world.id_at(id.index()), Some(*id));
            assert_eq!(world.box_of(*id).unwrap(), Aabb::from(object.ends));
            let touching: BTreeSet<_> = world.touching(*id).unwrap().into_iter().collect();
            let expected = pairs.iter().filter_map(|(_, _, a, b)| {
                if a == id {
                    Some(*b)
                } else if b == id {
                    Some(*a)
                } else {
                    None
                }
            });
            assert_eq!(touching, expected.collect());
        }
        touched = pairs;
    }
    assert!(world.explain().contains(&world.len().to_string()));
    world.save()
}

#[test]
fn events_are_those_of_brute_force() {
    for seed in 0..4 {
        let saved = frames::<3>(seed, &Executor::serial());
        // The same bits from any threads.
        assert_eq!(frames::<3>(seed, &Executor::threads(3).unwrap()), saved);
        frames::<2>(seed, &Executor::serial());
    }
}

#[test]
fn commands_from_many_threads() {
    let mut world = World3d::new();
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let world = &world;
            scope.spawn(move || {
                let ids: Vec<Id> = (0..100)
                    .map(|i| world.add([[f64::from(thread), f64::from(i), 0.0]; 2]).unwrap())
                    .collect();
                ids.iter().step_by(2).for_each(|id| world.remove(*id).unwrap());
                for id in ids.iter().skip(1).step_by(2) {
                    world.move_to(*id, [[f64::from(thread) * 9.0; 3]; 2]).unwrap();
                }
            });
        }
    });
    world.update().unwrap();
    assert_eq!((world.len(), world.began().len()), (200, 4 * 50 * 49 / 2));
    // and many ask at a time
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| assert_eq!(world.ask().count(&Aabb::new([-1.0; 3], [10.0; 3])), Ok(100)));
            scope.spawn(|| assert_eq!(world.began().len(), 4 * 50 * 49 / 2));
        }
    });
}

#[test]
fn all_commands() {
    let mut world = World2f::with_options(WorldOptions::new().margin(0.25).layer(1, 2)).unwrap();
    let ids = world
        .add_many(&[[[0.0, 0.0], [1.0, 1.0]], [[1.5, 0.0], [2.5, 1.0]], [[9.0, 9.0], [9.5, 9.5]]])
        .unwrap();
    let [a, b, c] = [ids[0], ids[1], ids[2]];
    world.update().unwrap();
    assert_eq!(world.began(), [IdPair { a, b }]); // by the margin
    world.report_again(a).unwrap();
    world.update().unwrap();
    assert_eq!(world.began(), [IdPair { a, b }]);
    world.set_margin(a, 9.0).unwrap();
    world.update().unwrap();
    assert_eq!(world.began(), [IdPair { a, b: c }]);
    world.set_margin(a, 0.0).unwrap();
    world.resize(a, [0.5, 0.5]).unwrap();
    world.apply().unwrap();
    assert_eq!(world.box_of(a).unwrap(), Aabb::new([0.25, 0.25], [0.75, 0.75]));
    assert_eq!(world.began(), [IdPair { a, b: c }]); // still
    world.update().unwrap();
    assert_eq!(
        world.ended().iter().map(|pair| (pair.b, pair.reason)).collect::<Vec<_>>(),
        [(b, EndReason::MovedApart), (c, EndReason::MovedApart)]
    );
    world.move_along(a, [[0.0, 0.0], [1.0, 1.0]], [9.0, 9.0]).unwrap();
    world.update().unwrap();
    assert_eq!(world.began(), [IdPair { a, b }, IdPair { a, b: c }]);
    world.update_moves(&[b, c], &[[[0.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 1.0]]]).unwrap();
    assert_eq!(world.pairs().len(), 3);
    world.set_user_data(c, 77).unwrap();
    world.remove_many(&[b, c]).unwrap();
    world.update().unwrap();
    assert_eq!((world.len(), world.user_data(c)), (1, Ok(77)));
    assert_eq!(
        world.join(&[[[0.5, 0.5], [0.6, 0.6]], [[50.0, 50.0], [60.0, 60.0]]]).unwrap(),
        [Pair { a: 0, b: a.index() }]
    );
    world.clear();
    assert!(world.is_empty() && format!("{world:?}").starts_with("World"));
}

#[test]
fn errors() {
    let mut world = World3f::new();
    let unit = [[0.0; 3], [1.0; 3]];
    let [a, b] = [world.add(unit).unwrap(), world.add(unit).unwrap()];
    world.update().unwrap();
    let kind = |result: Result<(), Error>| result.unwrap_err().kind();
    assert_eq!(kind(world.move_to(a, [[0.0; 3], [f32::NAN; 3]])), ErrorKind::NanCoordinate);
    assert_eq!(kind(world.add([[2.0; 3], [1.0; 3]]).map(|_| ())), ErrorKind::InvertedBox);
    let error = world.move_many(&[a, b], &[unit, [[0.0; 3], [f32::NAN; 3]]]).unwrap_err();
    assert_eq!(error.index(), Some(1));
    assert_eq!(kind(world.move_many(&[a, b], &[unit])), ErrorKind::SizeMismatch);
    assert_eq!(kind(world.update_moves(&[a], &[unit, unit])), ErrorKind::SizeMismatch);
    assert_eq!(kind(world.set_margin(a, f64::NAN)), ErrorKind::InvalidArgument);
    assert_eq!(
        kind(World3f::with_options(WorldOptions::new().margin(-1.0)).map(|_| ())),
        ErrorKind::InvalidArgument
    );
    world.remove(a).unwrap();
    world.update().unwrap();
    let foreign = World3f::new().add_many(&vec![unit; 9]).unwrap()[8];
    for id in [a, foreign, Id::from_bits(u64::MAX).unwrap(), Id::from_bits(1).unwrap()] {
        assert!(!world.contains(id));
        for result in [
            world.remove(id),
            world.move_to(id, unit),
            world.move_along(id, unit, [1.0; 3]),
            world.resize(id, [1.0; 3]),
            world.set_filter(id, ObjectFilter::default()),
            world.set_margin(id, 1.0),
            world.set_enabled(id, false),
            world.report_again(id),
            world.touching(id).map(|_| ()),
            world.box_of(id).map(|_| ()),
            world.update_moves(&[id], &[unit]),
        ] {
            assert_eq!(kind(result), ErrorKind::StaleId, "{id:?}");
        }
        assert_eq!(world.ask().exclude(id).count(&Aabb::from(unit)), Ok(1));
    }
    assert_eq!(world.set_user_data(foreign, 1).unwrap_err().kind(), ErrorKind::StaleId);
    assert_eq!(Id::from_bits(0), None);
    assert_eq!(Id::from_bits(b.to_bits()), Some(b));
    assert_eq!((world.id_at(77), world.len()), (None, 1));
    assert_eq!(std::mem::size_of::<Option<Id>>(), 8);
}

#[test]
fn accept_and_its_panics() {
    let panics = Arc::new(AtomicBool::new(false));
    let inside = panics.clone();
    let mut world = World3f::with_options(WorldOptions::new().accept(move |a, b| {
        assert!(!inside.load(Relaxed), "not now");
        (a.index() + b.index()) % 2 == 1
    }))
    .unwrap();
    let ids = world.add_many(&[[[0.0; 3], [1.0; 3]]; 5]).unwrap();
    panics.store(true, Relaxed);
    let caught = catch_unwind(AssertUnwindSafe(|| world.update())).unwrap_err();
    assert!(caught.downcast_ref::<&str>().unwrap().contains("not now"));
    assert!(world.is_empty() && world.began().is_empty()); // as it was
    panics.store(false, Relaxed);
    world.update().unwrap();
    assert_eq!(world.began().len(), 6);
    let mut fork = world.fork();
    drop(world); // whose accept the fork has, too
    fork.move_to(ids[0], [[5.0; 3], [6.0; 3]]).unwrap();
    fork.update().unwrap();
    fork.move_to(ids[0], [[0.0; 3], [1.0; 3]]).unwrap();
    fork.update().unwrap();
    assert_eq!(fork.began(), [IdPair { a: ids[0], b: ids[1] }, IdPair { a: ids[0], b: ids[3] }]);
}

#[test]
fn snapshots() {
    let mut world = World3f::new();
    let ids = world.add_many(&boxes::<3>(&mut Random(3), 50, false)).unwrap();
    world.update().unwrap();
    assert_eq!(world.save_changes().unwrap_err().kind(), ErrorKind::InvalidArgument); // of no base
    let base = world.save_base();
    world.move_to(ids[0], [[0.0; 3], [9.0; 3]]).unwrap();
    world.update().unwrap();
    let (changes, later) = (world.save_changes().unwrap(), world.save());
    let mut other = World3f::new();
    other.restore(&base).unwrap();
    assert_eq!((other.len(), other.save_base()), (50, base));
    other.restore_changes(&changes).unwrap();
    assert_eq!(other.save(), later);
    for cut in [0, 1, later.len() / 2, later.len() - 1] {
        assert_eq!(other.restore(&later[..cut]).unwrap_err().kind(), ErrorKind::BadSnapshot);
    }
    assert_eq!(other.restore_changes(&[1, 2, 3]).unwrap_err().kind(), ErrorKind::BadSnapshot);
    assert_eq!(World2f::new().restore(&later).unwrap_err().kind(), ErrorKind::BadSnapshot);
    assert_eq!(other.save(), later);
}

/// Where a ray enters a box: by the slabs.
fn enters(ray: &Ray<f64, 3>, ends: &[[f64; 3]; 2]) -> Option<f64> {
    let (mut from, mut to) = (0.0, ray.max_fraction);
    for axis in 0..3 {
        if ray.direction[axis] == 0.0 {
            if ray.origin[axis] < ends[0][axis] || ray.origin[axis] > ends[1][axis] {
                return None;
            }
            continue;
        }
        let mut at = [0, 1].map(|side: usize| (ends[side][axis] - ray.origin[axis]) / ray.direction[axis]);
        if at[0] > at[1] {
            at.swap(0, 1);
        }
        (from, to) = (f64::max(from, at[0]), f64::min(to, at[1]));
    }
    (from <= to).then(|| from)
}
fn squared_distance(point: &[f64; 3], ends: &[[f64; 3]; 2]) -> f64 {
    (0..3).map(|axis| (ends[0][axis] - point[axis]).max(point[axis] - ends[1][axis]).max(0.0).powi(2)).sum()
}

/// Every verb of `ask` against the definition; `name(i)` is what object i is called.
fn asks<I: Named + PartialEq + Ord + std::fmt::Debug>(
    rows: &[[[f64; 3]; 2]],
    name: &(dyn Fn(usize) -> I + Sync),
    ask: &(dyn Fn() -> Ask<'static, I, f64, 3> + Sync),
) {
    let mut random = Random(9);
    let mut point = || [0; 3].map(|_: i32| random.unit() * 7.0);
    let rays: Vec<_> = (0..60)
        .map(|i| {
            let (origin, to) = (point(), point());
            let direction = if i % 7 == 0 {
                [1.0, 0.0, 0.0]
            } else {
                [0, 1, 2].map(|axis: usize| to[axis] - origin[axis])
            };
            Ray { origin, direction, max_fraction: [0.5, 1.0, f64::INFINITY][i % 3] }
        })
        .collect();
    let firsts = ask().first_each(&rays).unwrap();
    let alls = ask().all_each(&rays).unwrap();
    let mut met = 0;
    assert_eq!((alls.len(), alls.is_empty(), alls.iter().len()), (60, false, 60));
    for (i, ray) in rays.iter().enumerate() {
        let mut expected: Vec<_> =
            rows.iter().enumerate().filter_map(|(i, row)| enters(ray, row).map(|at| (at, name(i)))).collect();
        expected.sort_by(|a, b| a.partial_cmp(b).unwrap());
        met += expected.len();
        let ids: BTreeSet<I> = expected.iter().map(|(_, id)| *id).collect();
        assert_eq!(alls[i].iter().map(|hit| hit.id).collect::<BTreeSet<_>>(), ids);
        assert!(alls[i].windows(2).all(|two| two[0].at <= two[1].at));
        assert_eq!(firsts[i], alls[i].first().copied());
        if let Some(hit) = firsts[i] {
            assert!((hit.at - expected[0].0).abs() < 1e-9);
        }
        assert_eq!(ask().first(ray).unwrap(), firsts[i]);
        assert_eq!(ask().all(ray).unwrap(), alls[i]);
        assert_eq!(ask().any(ray).unwrap(), !expected.is_empty());
        assert_eq!(ask().count(ray).unwrap(), expected.len() as u64);
        assert_eq!(ask().at_most(2).all(ray).unwrap(), alls[i][..alls[i].len().min(2)]);
        let mut visited = Vec::new();
        let result = ask().visit(ray, |hit| {
            visited.push(hit);
            if visited.len() == 2 {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        assert_eq!(result.unwrap().is_break(), alls[i].len() >= 2);
        assert_eq!(visited, alls[i][..alls[i].len().min(2)]);
        if let Some(hit) = firsts[i] {
            assert_eq!(ask().exclude(hit.id).first(ray).unwrap(), alls[i].get(1).copied());
            let queries = AtomicUsize::new(0);
            let not_that = |query: u32, id: I| {
                queries.fetch_max(query as usize, Relaxed);
                id != hit.id
            };
            let both = ask().accept(&not_that).first_each(&[*ray, *ray]).unwrap();
            assert_eq!(both, [alls[i].get(1).copied(); 2]);
            assert_eq!(queries.into_inner(), 1);
        }
    }
    assert!(met > 50);
    assert_eq!(ask().any_each(&rays).unwrap(), firsts.iter().map(Option::is_some).collect::<Vec<_>>());
    assert_eq!(
        ask().count_each(&rays).unwrap(),
        alls.iter().map(|hits| hits.len() as u64).collect::<Vec<_>>()
    );
    assert!(
        ask().first_each::<Ray<f64, 3>>(&[]).unwrap().is_empty()
            && ask().all_each::<Ray<f64, 3>>(&[]).unwrap().is_empty()
    );

    for _ in 0..40 {
        let center = point();
        let of = |wanted: &dyn Fn(&[[f64; 3]; 2]) -> bool| -> BTreeSet<I> {
            rows.iter().enumerate().filter(|(_, row)| wanted(row)).map(|(i, _)| name(i)).collect()
        };
        let set = |ids: Vec<I>| ids.into_iter().collect::<BTreeSet<_>>();
        let ends = [center, center.map(|x| x + 1.5)];
        assert_eq!(set(ask().all(&Aabb::from(ends)).unwrap()), of(&|row| touch(row, &ends)));
        let sphere = Sphere { center, radius: 1.2 };
        assert_eq!(set(ask().all(&sphere).unwrap()), of(&|row| squared_distance(&center, row) <= 1.2 * 1.2));
        let planes = [
            Plane { normal: [1.0, 0.0, 0.0], offset: -center[0] },
            Plane { normal: [0.0, -1.0, 0.0], offset: center[1] },
        ];
        let frustum = Frustum::new(&planes);
        assert_eq!(
            set(ask().all(&frustum).unwrap()),
            of(&|row| row[1][0] >= center[0] && row[0][1] <= center[1])
        );
        let mut visited = Vec::new();
        assert!(ask()
            .visit(&frustum, |id| {
                visited.push(id);
                ControlFlow::Continue(())
            })
            .unwrap()
            .is_continue());
        assert_eq!(set(visited), set(ask().all(&frustum).unwrap()));
        let far = Sweep::new([center, center], [0.0, 0.0, 50.0]);
        let along = of(&|row| touch(row, &[center, [center[0], center[1], center[2] + 50.0]]));
        assert_eq!(ask().all(&far).unwrap().iter().map(|hit| hit.id).collect::<BTreeSet<_>>(), along);

        let mut distances: Vec<_> = rows.iter().map(|row| squared_distance(&center, row)).collect();
        distances.sort_by(|a, b| a.partial_cmp(b).unwrap());
        let near = ask().k_nearest(&Nearest::new(center), 5).unwrap();
        assert!(near.iter().zip(&distances).all(|(hit, at)| (hit.at - at).abs() < 1e-9) && near.len() == 5);
        assert_eq!(ask().nearest(&Nearest::new(center)).unwrap(), Some(near[0]));
        assert_eq!(ask().nearest_each(&[Nearest::new(center); 3]).unwrap(), [Some(near[0]); 3]);
        assert_eq!(
            ask()
                .nearest(&NearestToBox { aabb: Aabb::new(center, center), max_distance: f64::INFINITY })
                .unwrap()
                .unwrap()
                .at,
            near[0].at
        );
        assert!(ask().k_nearest(&Nearest::new(center), 0).unwrap().is_empty());
        assert_eq!(ask().nearest(&Nearest { point: [99.0; 3], max_distance: 1.0 }).unwrap(), None);
    }
    let panics = |_: u32, _: I| -> bool { panic!("seen") };
    let all = Aabb::new([0.0; 3], [9.0; 3]);
    assert!(catch_unwind(AssertUnwindSafe(|| ask().accept(&panics).any(&all))).is_err());
    assert!(catch_unwind(AssertUnwindSafe(|| ask().visit(&all, |_| panic!("seen")))).is_err());
    let error = ask().first_each(&[rays[0], Ray::new([f64::NAN; 3], [1.0; 3])]).unwrap_err();
    assert!(error.to_string().to_lowercase().contains("nan"), "{error}");
}

#[test]
fn queries() {
    let rows: Vec<[[f64; 3]; 2]> = boxes::<3>(&mut Random(4), 300, false)
        .iter()
        .map(|ends| ends.map(|end| end.map(f64::from)))
        .collect();
    // Leaked, so that the questions need no lifetime.
    let world: &'static mut World3d = Box::leak(Box::new(World3d::new()));
    let ids = world.add_many(&rows).unwrap();
    world.update().unwrap();
    let world: &'static World3d = world;
    asks(&rows, &|i| ids[i], &|| world.ask());
    let index: &'static mut BoxIndex<f64, 3> =
        Box::leak(Box::new(BoxIndex::with_executor(&Executor::threads(2).unwrap())));
    index.build(&rows).unwrap();
    let index: &'static BoxIndex<f64, 3> = index;
    asks(&rows, &|i| i as u32, &|| index.ask());
}

#[test]
fn options_of_each_are_those_of_as_many_adds() {
    let mut random = Random(5);
    let rows: Vec<_> = (0..60).map(|_| box_of::<3>(&mut random, false, 3.0)).collect();
    let options: Vec<_> = (0..60)
        .map(|_| ObjectOptions {
            filter: ObjectFilter {
                category: 1 << random.below(3),
                mask: random.below(8) as u32,
                owner: random.below(20) as u32,
                is_static: random.below(4) == 0,
            },
            margin: random.below(3) as f64 / 4.0,
            disabled: random.below(5) == 0,
            user_data: random.bits(),
        })
        .collect();
    let (mut many, mut one) = (World3f::new(), World3f::new());
    let ids = many.add_with(&rows, &options).unwrap();
    for (i, id) in ids.iter().enumerate() {
        assert_eq!(one.add_with(&rows[i..i + 1], &options[i]).unwrap(), [*id]);
        assert_eq!(many.user_data(*id), Ok(options[i].user_data));
    }
    many.update().unwrap();
    one.update().unwrap();
    assert!(one.began().len() > 10);
    assert_eq!(many.began(), one.began());
    assert_eq!(many.save(), one.save());
    let error = many.add_with(&rows, &options[1..]).unwrap_err();
    assert!(error.to_string().contains("there are 60 boxes and 59 options"), "{error}");
    let mut wrong = options.clone();
    wrong[7].margin = -1.0;
    let error = many.add_with(&rows, &wrong).unwrap_err();
    assert!(error.to_string().contains("margin -1 of new object 7"), "{error}");
}

#[test]
fn layers_and_owners_of_queries() {
    let mut world = World2f::new();
    let row = [[0.0, 0.0], [1.0, 1.0]];
    let filters = [(1, 1, 5), (2, 3, 6), (2, 1, 7)];
    let ids = filters.map(|(category, mask, owner)| {
        let filter = ObjectFilter { category, mask, owner, is_static: false };
        world.add_with(&[row], &ObjectOptions { filter, ..Default::default() }).unwrap()[0]
    });
    world.update().unwrap();
    let all = Aabb::from(row);
    assert_eq!(world.ask().all(&all).unwrap(), ids);
    assert_eq!(world.ask().layers(2, 2).all(&all).unwrap(), [ids[1]]);
    assert_eq!(world.ask().not_of_owner(6).all(&all).unwrap(), [ids[0], ids[2]]);
    let mut index = BoxIndex::new();
    index.build(&[row; 3]).unwrap();
    let (category, mask, owner) = (filters.map(|of| of.0), filters.map(|of| of.1), filters.map(|of| of.2));
    assert_eq!(index.ask().layers_of_objects(&category, &mask).layers(2, 2).all(&all).unwrap(), [1]);
    assert_eq!(index.ask().owners_of_objects(&owner).not_of_owner(6).all(&all).unwrap(), [0, 2]);
}

#[test]
fn indexes() {
    let mut index = BoxIndex::<f32, 2>::new();
    let (near, far) = ([[0.0, 0.0], [1.0, 1.0]], [[8.0, 8.0], [9.0, 9.0]]);
    index.insert(&[7, 3], &[near, far]).unwrap();
    assert_eq!(
        (index.len(), index.contains(7), index.contains(0), index.is_empty()),
        (2, true, false, false)
    );
    assert_eq!(index.box_of(3).unwrap(), Aabb::from(far));
    assert_eq!(
        index.join(&[far, near, near]).unwrap(),
        [Pair { a: 0, b: 3 }, Pair { a: 1, b: 7 }, Pair { a: 2, b: 7 }]
    );
    index.move_many(&[3], &[near]).unwrap();
    assert_eq!(index.ask().all(&Aabb::from(near)).unwrap(), [3, 7]);
    assert_eq!(index.insert(&[3], &[near]).unwrap_err().kind(), ErrorKind::InvalidArgument);
    assert_eq!(index.erase(&[5]).unwrap_err().kind(), ErrorKind::InvalidArgument);
    assert_eq!(index.move_many(&[3, 7], &[near]).unwrap_err().kind(), ErrorKind::SizeMismatch);
    assert!(index.box_of(5).is_err());
    index.erase(&[3, 7]).unwrap();
    assert!(index.is_empty() && format!("{index:?}").starts_with("BoxIndex"));
    assert_eq!(index.ask().any(&Aabb::from(near)), Ok(false));
    index.insert(&[1_000_000], &[near]).unwrap();
    assert_eq!(index.ask().nearest(&Nearest::new([5.0, 5.0])).unwrap().unwrap().id, 1_000_000);
}
