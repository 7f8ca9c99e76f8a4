// SPDX-License-Identifier: MIT
//! Compiles the library with the system's C++ compiler: several files at a time, as many as cargo allows.
//!
//! `cpp/` has the sources. In Jostle's repository it has links to them; `cargo package` copies what they lead
//! to.
//!
//! CXX, CXXFLAGS, AR and CXXSTDLIB mean what they do elsewhere. JOSTLE_HIGHWAY_INCLUDE is the folder that has
//! `hwy/`, the headers of Google Highway, where the compiler doesn't find them by itself.

use std::env;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{exit, Command};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// What a feature of the crate needs: rooms, which are folders of `cpp/src/`, and files of `cpp/src/c_api/`.
struct Part {
    feature: &'static str, // empty: always
    rooms: &'static [&'static str],
    c_api: &'static [&'static str],
}

// As CMakeLists.txt has them, without shapes and contacts. describe.py reads here which functions belong to
// which feature.
const PARTS: [Part; 2] = [
    Part {
        feature: "",
        rooms: &["base", "simd", "process", "engine", "pairs", "neighbors"],
        c_api: &["common", "handles", "neighbors", "pairs", "process", "recorder"],
    },
    Part {
        feature: "world",
        rooms: &["index", "world"],
        c_api: &[
            "index",
            "pair_slots",
            "queries",
            "world",
            "world_commands",
            "world_objects",
            "world_pairs",
            "world_queries",
        ],
    },
];

fn has_feature(name: &str) -> bool {
    name.is_empty() || env::var_os(format!("CARGO_FEATURE_{}", name.to_uppercase())).is_some()
}

fn variable(name: &str) -> Option<String> {
    println!("cargo:rerun-if-env-changed={name}");
    env::var(name).ok().filter(|value| !value.trim().is_empty())
}

fn fail(message: &str) -> ! {
    eprintln!("jostle: {message}");
    exit(1)
}

fn sources_below(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| {
        fail(&format!(
            "can't read {}: {error}. In a copy of the repository, cpp/src and cpp/include are symbolic links",
            folder.display()
        ))
    });
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry of a folder").path()).collect();
    paths.sort(); // the same archive whatever the folder lists first
    for path in paths {
        if path.is_dir() {
            sources_below(&path, found);
        } else if path.extension().map_or(false, |extension| extension == "cpp") {
            found.push(path);
        }
    }
}

/// What the compiler is called for.
struct Unit {
    file: PathBuf,
    bytes: u64, // of the sources in it
}

/// Small files go together, since all include the same headers: that halves the time. Large ones stay alone,
/// and some have to: kernels include themselves, and others instantiate what must not be used before. No two
/// have a local name in common: one of Jostle's tests compiles all of them as one.
fn units_of(sources: Vec<PathBuf>, out: &Path, name: &str) -> Vec<Unit> {
    const LARGE: u64 = 15_500;
    let mut units = Vec::new();
    let (mut together, mut bytes) = (String::new(), 0);
    let close = |together: &mut String, bytes: &mut u64, units: &mut Vec<Unit>| {
        if *bytes > 0 {
            let file = out.join(format!("together_{name}_{}.cpp", units.len()));
            fs::write(&file, std::mem::take(together)).expect("writing into OUT_DIR");
            units.push(Unit { file, bytes: std::mem::take(bytes) });
        }
    };
    for file in sources {
        let size = fs::metadata(&file).map_or(0, |about| about.len());
        if size > LARGE || file.components().any(|part| part.as_os_str() == "kernels") {
            units.push(Unit { file, bytes: size + LARGE });
            continue;
        }
        if bytes + size > 2 * LARGE {
            close(&mut together, &mut bytes, &mut units);
        }
        together += &format!("#include {:?}\n", file.display().to_string());
        bytes += size;
    }
    close(&mut together, &mut bytes, &mut units);
    units
}

/// A program and the arguments that come first, as in `CXX="ccache g++"`.
fn command(words: &[String]) -> Command {
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]);
    command
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

fn main() {
    let cpp = PathBuf::from(env::var_os("CARGO_MANIFEST_DIR").unwrap()).join("cpp");
    let out = PathBuf::from(env::var_os("OUT_DIR").unwrap());
    println!("cargo:rerun-if-changed=build.rs");
    for folder in ["src", "include"] {
        println!("cargo:rerun-if-changed={}", cpp.join(folder).display());
    }
    let target = env::var("TARGET").unwrap();
    if target.contains("msvc") {
        fail("MSVC isn't supported: use a target such as x86_64-pc-windows-gnu");
    }

    let mut units = Vec::new();
    for part in PARTS.iter().filter(|part| has_feature(part.feature)) {
        let mut sources = Vec::new();
        for room in part.rooms {
            sources_below(&cpp.join("src").join(room), &mut sources);
        }
        sources.extend(part.c_api.iter().map(|file| cpp.join("src/c_api").join(file).with_extension("cpp")));
        units.extend(units_of(sources, &out, part.feature));
    }
    // The largest first, so that no core is left with one at the end.
    units.sort_by_key(|unit| std::cmp::Reverse(unit.bytes));

    let compiler = words(&variable("CXX").unwrap_or_else(|| "c++".into()));
    let version = command(&compiler).arg("--version").output().unwrap_or_else(|error| {
        fail(&format!(
            "can't run the C++ compiler {}: {error}. Install one (Debian: g++), or set CXX",
            compiler[0]
        ))
    });
    let is_clang = String::from_utf8_lossy(&version.stdout).contains("clang");
    let mut flags: Vec<OsString> =
        ["-std=c++20", "-fPIC", "-fvisibility=hidden", "-DNDEBUG", "-w", "-DJOSTLE_WITHOUT_CONTACTS"]
            .map(Into::into)
            .into();
    flags.push("-ffp-contract=off".into()); // the same answers from every compiler
    if !is_clang {
        // g++ would leave out vzeroupper where it thinks that few registers are used.
        flags.push("-fno-ipa-ra".into());
    }
    // Without any optimisation a debug build would search twenty times as long, and compile hardly faster.
    let level = match env::var("OPT_LEVEL").unwrap().as_str() {
        "0" => "1".to_owned(),
        "z" => "s".to_owned(),
        level => level.to_owned(),
    };
    flags.push(format!("-O{level}").into());
    if env::var("DEBUG").map_or(false, |debug| debug == "true") && level != "1" {
        flags.push("-g1".into());
    }
    for folder in ["include", "src"] {
        flags.push("-I".into());
        flags.push(cpp.join(folder).into());
    }
    if target.contains("windows") {
        flags.extend(["-Wa,-muse-unaligned-vector-move", "-DJOSTLE_UNALIGNED_VECTOR_MOVES"].map(Into::into));
    }
    if let Some(folder) = variable("JOSTLE_HIGHWAY_INCLUDE") {
        flags.push("-isystem".into());
        flags.push(folder.into());
    }
    flags.extend(words(&variable("CXXFLAGS").unwrap_or_default()).into_iter().map(Into::into));

    let probe = out.join("probe.cpp");
    fs::write(&probe, "#include <hwy/highway.h>\n").expect("writing into OUT_DIR");
    let has_highway = command(&compiler)
        .args(&flags)
        .arg("-E")
        .arg(&probe)
        .output()
        .map_or(false, |made| made.status.success());
    if has_highway {
        flags.push("-DJOSTLE_WITH_SIMD".into());
    } else {
        println!("cargo:warning=jostle is built without SIMD, several times as slow: Google Highway's headers aren't there (Debian: libhwy-dev)");
    }

    let objects: Vec<PathBuf> = (0..units.len()).map(|i| out.join(format!("{i}.o"))).collect();
    let next = AtomicUsize::new(0);
    let jobs = env::var("NUM_JOBS").ok().and_then(|jobs| jobs.parse().ok()).unwrap_or(1);
    thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| loop {
                let i = next.fetch_add(1, Ordering::Relaxed);
                if i >= units.len() {
                    return;
                }
                let made = command(&compiler).args(&flags).arg("-c").arg(&units[i].file).arg("-o").arg(&objects[i]).output();
                match made {
                    Ok(made) if made.status.success() => {}
                    Ok(made) => fail(&format!(
                        "{} can't compile {}; Jostle needs C++20, as g++ has it from version 11 and clang from 14 on:\n{}",
                        compiler.join(" "),
                        units[i].file.display(),
                        String::from_utf8_lossy(&made.stderr)
                    )),
                    Err(error) => fail(&format!("can't run {}: {error}", compiler[0])),
                }
            });
        }
    });

    let archive = out.join("libjostle.a");
    let _ = fs::remove_file(&archive);
    let archiver = words(&variable("AR").unwrap_or_else(|| "ar".into()));
    let made = command(&archiver).arg("crs").arg(&archive).args(&objects).status();
    if !made.map_or(false, |status| status.success()) {
        fail(&format!("{} can't make {}", archiver[0], archive.display()));
    }
    for object in objects {
        let _ = fs::remove_file(object); // the archive has it
    }
    println!("cargo:rustc-link-search=native={}", out.display());
    println!("cargo:rustc-link-lib=static=jostle");
    let standard = if target.contains("apple") || target.contains("freebsd") { "c++" } else { "stdc++" };
    println!("cargo:rustc-link-lib=dylib={}", variable("CXXSTDLIB").unwrap_or_else(|| standard.into()));
    if target.contains("linux") {
        println!("cargo:rustc-link-lib=dylib=pthread");
    }
}
