//! The core's dependency tree, as cargo resolves it, has no window in it.

use std::process::Command;

fn tree(package: &str) -> String {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--edges", "normal,build"])
        .args(["--prefix", "none", "--format", "{p}", "--package", package])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs the tests, so it is there");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("package names are text")
}

fn has_window(tree: &str) -> bool {
    let window = ["egui", "eframe", "egui_plot", "winit", "glow", "rfd"];
    tree.lines().filter_map(|line| line.split(' ').next()).any(|name| window.contains(&name))
}

#[test]
fn core_has_no_window_in_its_tree() {
    assert!(!has_window(&tree("flqr-core")), "{}", tree("flqr-core"));
    // The check can see one where it is.
    assert!(has_window(&tree("flqr-gui")));
}
