use std::thread;

use super::*;

fn folder(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("spikeloop-files-{name}-{}", std::process::id()));
    fs::create_dir_all(&path).unwrap();
    path
}

#[test]
fn what_is_done_in_turn_loses_nothing() {
    let folder = folder("turns");
    let file = folder.join("count");
    let once = || {
        in_turn(&file, || {
            let count: u32 = fs::read_to_string(&file).map_or(0, |text| text.parse().unwrap());
            thread::yield_now();
            write_atomically(&file, (count + 1).to_string().as_bytes()).unwrap();
        });
    };
    thread::scope(|scope| {
        (0..8).for_each(|_| {
            scope.spawn(|| (0..20).for_each(|_| once()));
        });
    });
    assert_eq!(fs::read_to_string(&file).unwrap(), "160");
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn what_killed_processes_left_of_a_file_is_removed_by_the_next_that_writes_it() {
    let folder = folder("partials");
    let kept = [
        "a.json",
        ".a.json.tmp",
        ".a.json.x.tmp",
        ".b.json.7.tmp",
        ".a.json.7.old",
        "a.json.7.tmp",
    ];
    let partials = [".a.json.7.tmp", ".a.json.4294967295.tmp"];
    for name in kept.iter().chain(&partials) {
        fs::write(folder.join(name), name).unwrap();
    }
    let names = || {
        let entries = fs::read_dir(&folder).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    };
    in_turn(&folder.join("a.json"), || ());
    let mut expected = kept;
    expected.sort_unstable();
    assert_eq!(names(), expected);
    OwnFolder::take(&folder).unwrap().remove_partials(&[folder.join("b.json"), folder.join("c")]);
    assert!(!names().iter().any(|name| name == ".b.json.7.tmp"));
    assert_eq!(names().len(), kept.len());
    fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn a_folder_is_taken_once_at_a_time() {
    let folder = folder("own");
    let taken = OwnFolder::take(&folder).unwrap();
    let error = OwnFolder::take(&folder).unwrap_err().to_string();
    let text = "another run writes there; wait for its end, or give another folder";
    assert_eq!(error, format!("{}: {text}", folder.display()));
    // Its files are written in turn meanwhile.
    assert_eq!(in_turn(&folder.join("file"), || 7), 7);
    drop(taken);
    OwnFolder::take(&folder).unwrap();
    fs::remove_dir_all(&folder).unwrap();
}
