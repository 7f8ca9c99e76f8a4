// SPDX-License-Identifier: MIT
mod common;

use common::{boxes, touch, touching, Random};
use jostle::{
    find_pairs_brute_force, Aabb, Boxes, Coordinate, ErrorKind, Executor, Filter, Order, Pair, PairFinder,
    Pairs, Values,
};
use std::ops::ControlFlow;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Mutex;

fn sorted(pairs: Pairs<'_>) -> Vec<(u32, u32)> {
    let mut all: Vec<_> = pairs.iter().map(|pair| (pair.a, pair.b)).collect();
    all.sort_unstable();
    all
}

fn agrees<T: Coordinate<D> + std::ops::AddAssign, const D: usize>(
    finder: &mut PairFinder,
    boxes: &[[[T; D]; 2]],
) {
    let expected = touching(boxes);
    let found = finder.find(boxes).unwrap();
    assert_eq!(found.len(), expected.len());
    assert_eq!(found.is_empty(), expected.is_empty());
    assert_eq!(found.iter().len(), found.iter().count());
    assert_eq!(found.blocks().flatten().copied().collect::<Vec<_>>(), found.to_vec());
    assert_eq!(sorted(found), expected);
    let found = finder.find_with(boxes, None, &Filter::new(), Order::Sorted).unwrap();
    assert_eq!(found.iter().map(|pair| (pair.a, pair.b)).collect::<Vec<_>>(), expected);
    let brute = find_pairs_brute_force(boxes, None, &Filter::new()).unwrap();
    assert_eq!(brute.iter().map(|pair| (pair.a, pair.b)).collect::<Vec<_>>(), expected);
}

#[test]
fn pairs_are_those_of_brute_force() {
    let mut random = Random(1);
    let mut finder = PairFinder::new();
    for round in 0..60 {
        let count = [0, 1, 2, 3, 17, 64, 300][random.below(7)];
        let hostile = round % 3 == 0;
        let in_3d = boxes::<3>(&mut random, count, hostile);
        agrees(&mut finder, &in_3d);
        let in_2d = boxes::<2>(&mut random, count, hostile);
        agrees(&mut finder, &in_2d);
        let doubles: Vec<_> = in_3d.iter().map(|ends| ends.map(|end| end.map(f64::from))).collect();
        agrees(&mut finder, &doubles);
        let doubles: Vec<_> = in_2d.iter().map(|ends| ends.map(|end| end.map(f64::from))).collect();
        agrees(&mut finder, &doubles);
    }
}

#[test]
fn two_sets() {
    let mut random = Random(2);
    let mut finder = PairFinder::new();
    for _ in 0..20 {
        let (first, second) = (boxes::<3>(&mut random, 90, false), boxes::<3>(&mut random, 70, false));
        let mut expected = Vec::new();
        for (a, one) in first.iter().enumerate() {
            expected
                .extend((0..second.len()).filter(|b| touch(one, &second[*b])).map(|b| (a as u32, b as u32)));
        }
        assert!(!expected.is_empty());
        assert_eq!(sorted(finder.find_between(&first, &second).unwrap()), expected);
        let brute = find_pairs_brute_force(&first, Some(Boxes::from(&second)), &Filter::new()).unwrap();
        assert_eq!(brute.iter().map(|pair| (pair.a, pair.b)).collect::<Vec<_>>(), expected);

        let random_values =
            |random: &mut Random, count| -> Vec<u32> { (0..count).map(|_| random.below(4) as u32).collect() };
        let (category, mask) = (random_values(&mut random, 90), random_values(&mut random, 90));
        let (category_b, mask_b) = (random_values(&mut random, 70), random_values(&mut random, 70));
        let (owner, owner_b) = (random_values(&mut random, 90), random_values(&mut random, 70));
        let filter = Filter::new()
            .layers(&category, &mask)
            .layers_of_second(&category_b, &mask_b)
            .owners(&owner)
            .owners_of_second(&owner_b);
        expected.retain(|(a, b)| {
            let (a, b) = (*a as usize, *b as usize);
            category[a] & mask_b[b] != 0 && category_b[b] & mask[a] != 0 && owner[a] != owner_b[b]
        });
        assert!(!expected.is_empty());
        let second = Some(Boxes::from(&second));
        assert_eq!(sorted(finder.find_with(&first, second, &filter, Order::Canonical).unwrap()), expected);
        let brute = find_pairs_brute_force(&first, second, &filter).unwrap();
        assert_eq!(brute.iter().map(|pair| (pair.a, pair.b)).collect::<Vec<_>>(), expected);
    }
}

/// As glam's: laid out as an array, and one by `as_ref()`.
#[repr(C)]
#[derive(Clone, Copy)]
struct Vec3 {
    x: f32,
    y: f32,
    z: f32,
}
impl AsRef<[f32; 3]> for Vec3 {
    fn as_ref(&self) -> &[f32; 3] {
        // SAFETY: repr(C), three times f32.
        unsafe { &*(self as *const Vec3 as *const [f32; 3]) }
    }
}
#[allow(dead_code)]
struct Body {
    name: String,
    max: Vec3,
    team: u32,
    min: Vec3,
    category: u32,
}

#[test]
fn boxes_are_read_wherever_they_lie() {
    let mut random = Random(3);
    let rows = boxes::<3>(&mut random, 200, false);
    let expected = touching(&rows);
    let vector = |point: [f32; 3]| Vec3 { x: point[0], y: point[1], z: point[2] };
    let bodies: Vec<_> = rows
        .iter()
        .enumerate()
        .map(|(i, [lo, hi])| Body {
            name: i.to_string(),
            max: vector(*hi),
            team: i as u32 % 5,
            min: vector(*lo),
            category: 1 << (i % 3),
        })
        .collect();
    let mut finder = PairFinder::new();
    let view = Boxes::of(&bodies, |body| (body.min.as_ref(), body.max.as_ref()));
    assert_eq!((view.len(), view.is_empty()), (200, false));
    assert_eq!(sorted(finder.find(view).unwrap()), expected);

    let flat: Vec<[f32; 6]> =
        rows.iter().map(|[lo, hi]| [lo[0], lo[1], lo[2], hi[0], hi[1], hi[2]]).collect();
    assert_eq!(sorted(finder.find(&flat).unwrap()), expected);
    let aabbs: Vec<Aabb<f32, 3>> = rows.iter().map(|ends| Aabb::from(*ends)).collect();
    assert_eq!(sorted(finder.find(&aabbs[..]).unwrap()), expected);
    let arrays: Vec<Vec<f32>> = (0..6).map(|i| flat.iter().map(|row| row[i]).collect()).collect();
    let [x0, y0, z0, x1, y1, z1]: [&[f32]; 6] = std::array::from_fn(|i| &arrays[i][..]);
    assert_eq!(sorted(finder.find(Boxes::of_arrays([x0, y0, z0], [x1, y1, z1])).unwrap()), expected);
    assert!(catch_unwind(|| Boxes::of_arrays([x0, y0, z0], [x1, y1, &z1[1..]])).is_err());

    // Values inside the same structs.
    let masks = vec![3; 200];
    let filter = Filter::new()
        .owners(Values::of(&bodies, |body| &body.team))
        .layers(Values::of(&bodies, |body| &body.category), &masks);
    let wanted = |(a, b): &(u32, u32)| a % 5 != b % 5 && a % 3 < 2 && b % 3 < 2;
    let expected: Vec<_> = expected.into_iter().filter(wanted).collect();
    assert!(!expected.is_empty());
    assert_eq!(sorted(finder.find_with(view, None, &filter, Order::Canonical).unwrap()), expected);
    assert!(finder
        .find(Boxes::<f32, 3>::of(&bodies[..0], |body| (body.min.as_ref(), body.max.as_ref())))
        .unwrap()
        .is_empty());
}

#[test]
fn what_does_not_lie_in_the_structs_is_refused() {
    let boxed: Vec<(Box<[f32; 3]>, [f32; 3])> = vec![(Box::new([0.0; 3]), [1.0; 3])];
    assert!(catch_unwind(|| Boxes::of(&boxed, |(lo, hi)| (&**lo, hi)).len()).is_err());
    enum Either {
        First([f32; 3], [f32; 3]),
        Second(u64, [f32; 3], [f32; 3]),
    }
    let mixed = [Either::First([0.0; 3], [1.0; 3]), Either::Second(7, [0.0; 3], [1.0; 3])];
    let bounds = |one| match one {
        &Either::First(ref lo, ref hi) | &Either::Second(_, ref lo, ref hi) => (lo, hi),
    };
    let first_alone = catch_unwind(|| Boxes::of(&mixed[..1], bounds).len()).unwrap();
    assert_eq!(first_alone, 1);
    assert!(matches!(mixed[1], Either::Second(7, ..)));
    assert!(catch_unwind(|| Boxes::of(&mixed, |one| match one {
        Either::First(lo, hi) => (lo, hi),
        Either::Second(_, lo, hi) => (hi, lo),
    })
    .len())
    .is_err());
    let outside = 7;
    assert!(catch_unwind(|| Values::of(&[1u32, 2], |_| &outside)).is_err());
}

#[test]
fn errors_name_the_box() {
    let mut finder = PairFinder::new();
    let mut rows = boxes::<3>(&mut Random(4), 50, false);
    rows[31][1][2] = f32::NAN;
    rows[40][1][2] = f32::NAN;
    let error = finder.find(&rows).unwrap_err();
    assert_eq!((error.kind(), error.index()), (ErrorKind::NanCoordinate, Some(31)));
    assert!(error.to_string().contains("31") && error.to_string().to_lowercase().contains("nan"), "{error}");
    assert!(format!("{error:?}").starts_with("NanCoordinate: "));
    rows[31][1][2] = -1.0;
    rows[40] = rows[39];
    let error = finder.find(&rows).unwrap_err();
    assert_eq!((error.kind(), error.index()), (ErrorKind::InvertedBox, Some(31)));
    rows[31] = rows[30];
    assert_eq!(sorted(finder.find(&rows).unwrap()), touching(&rows)); // it works on
    let filter = Filter::new().owners(&[1, 2, 3]);
    let error = finder.find_with(&rows, None, &filter, Order::Canonical).unwrap_err();
    assert_eq!(error.kind(), ErrorKind::SizeMismatch);
    let _: &(dyn std::error::Error + Send + Sync) = &error;
}

#[test]
fn accept_and_ghosts() {
    let mut finder = PairFinder::new();
    let rows = boxes::<3>(&mut Random(5), 400, false);
    let expected = touching(&rows);
    let asked = AtomicUsize::new(0);
    let accept = |a: u32, b: u32| {
        asked.fetch_add(1, Ordering::Relaxed);
        (a ^ b) % 3 == 0
    };
    let found =
        sorted(finder.find_with(&rows, None, &Filter::new().accept(&accept), Order::Canonical).unwrap());
    assert_eq!(found, expected.iter().copied().filter(|(a, b)| (a ^ b) % 3 == 0).collect::<Vec<_>>());
    assert_eq!(asked.load(Ordering::Relaxed), expected.len());
    let found = sorted(finder.find_with(&rows, None, &Filter::new().ghosts(100), Order::Canonical).unwrap());
    assert_eq!(found, expected.iter().copied().filter(|(a, b)| *a < 300 || *b < 300).collect::<Vec<_>>());
}

#[test]
fn panics_go_on_after_the_call() {
    let mut finder = PairFinder::new();
    let rows = boxes::<3>(&mut Random(6), 400, false);
    let panics = |_: u32, _: u32| -> bool { panic!("no more") };
    let filter = Filter::new().accept(&panics);
    let caught = catch_unwind(AssertUnwindSafe(|| {
        finder.find_with(&rows, None, &filter, Order::Canonical).map(|_| ())
    }))
    .unwrap_err();
    assert_eq!(caught.downcast_ref::<&str>(), Some(&"no more"));
    let caught =
        catch_unwind(AssertUnwindSafe(|| finder.stream(&rows, None, &Filter::new(), |_| panic!("full"))))
            .unwrap_err();
    assert_eq!(caught.downcast_ref::<&str>(), Some(&"full"));
    let executor = Executor::host(3, |_| panic!("no threads"));
    let mut on_host = PairFinder::with_executor(&executor);
    let many = boxes::<3>(&mut Random(6), 20_000, false);
    let caught = catch_unwind(AssertUnwindSafe(|| on_host.find(&many).map(|_| ()))).unwrap_err();
    assert_eq!(caught.downcast_ref::<&str>(), Some(&"no threads"));
    assert_eq!(sorted(finder.find(&rows).unwrap()), touching(&rows)); // it works on
}

#[test]
fn streams() {
    let mut finder = PairFinder::new();
    let rows = boxes::<3>(&mut Random(7), 3000, false);
    let canonical = finder.find(&rows).unwrap().to_vec();
    let chunks = Mutex::new(Vec::new());
    let result = finder.stream(&rows, None, &Filter::new(), |chunk| {
        chunks.lock().unwrap().push((chunk.block, chunk.part, chunk.pairs.to_vec()));
        ControlFlow::Continue(())
    });
    assert_eq!(result, Ok(ControlFlow::Continue(())));
    let mut chunks = chunks.into_inner().unwrap();
    chunks.sort_by_key(|(block, part, _)| (*block, *part));
    assert_eq!(chunks.into_iter().flat_map(|(_, _, pairs)| pairs).collect::<Vec<Pair>>(), canonical);
    assert_eq!(
        finder.stream(&rows, None, &Filter::new(), |_| ControlFlow::Break(())),
        Ok(ControlFlow::Break(()))
    );
    finder.release_memory();
    assert_eq!(finder.find(&rows).unwrap().to_vec(), canonical);
}

#[test]
fn the_same_from_any_threads() {
    let rows = boxes::<3>(&mut Random(8), 30_000, false);
    let serial = Executor::serial();
    assert_eq!(serial.concurrency(), 1);
    let expected = PairFinder::with_executor(&serial).find(&rows).unwrap().to_vec();
    assert!(expected.len() > 1000);
    let calls = std::sync::Arc::new(AtomicUsize::new(0));
    let counted = calls.clone();
    let executors = [
        Executor::threads(1).unwrap(),
        Executor::threads(4).unwrap(),
        Executor::host(5, move |work| {
            std::thread::scope(|scope| {
                for _ in 0..4 {
                    scope.spawn(|| {
                        counted.fetch_add(1, Ordering::Relaxed);
                        work();
                    });
                }
            })
        }),
        Executor::host(7, |_| {}), // which leaves all of it to the caller
    ];
    assert_eq!(executors.iter().map(Executor::concurrency).collect::<Vec<_>>(), [1, 4, 5, 7]);
    for executor in &executors {
        let mut finder = PairFinder::with_executor(executor);
        assert_eq!(finder.find(&rows).unwrap().to_vec(), expected);
        assert_eq!(finder.find(&rows).unwrap().to_vec(), expected);
    }
    assert!(calls.load(Ordering::Relaxed) >= 4);
    assert_eq!(PairFinder::new().find(&rows).unwrap().to_vec(), expected);
    // A finder keeps its executor, and works on another thread.
    let mut finder = PairFinder::with_executor(&Executor::threads(2).unwrap());
    let found = std::thread::spawn(move || finder.find(&rows).unwrap().to_vec()).join().unwrap();
    assert_eq!(found, expected);
}
