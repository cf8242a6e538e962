use super::*;
use crate::record::LogKind;

fn read(text: impl AsRef<[u8]>, map: &[&str]) -> Result<Log, LogError> {
    let entries = map.iter().map(|entry| entry.parse().unwrap()).collect();
    let map = ColumnMap::new(entries).unwrap();
    read_log(text.as_ref(), "run.csv", &ReadOptions::new(&map), &mut |_| ControlFlow::Continue(()))
}

const PLAIN: &str = "time_s,motor_angle_rad,torque_nm\n0,0.5,1\n0.001,0.6,-2\n";

#[test]
fn dialects_of_one_log_read_alike() {
    let plain = read(PLAIN, &[]).unwrap();
    assert_eq!(plain.kind(), Ok(LogKind::Bench));
    assert_eq!(plain.column("torque_nm"), Some(&[1.0, -2.0][..]));
    for text in [
        PLAIN.replace('\n', "\r\n"),
        format!("\u{feff}{PLAIN}"),
        format!("\u{feff}# a comment, with \"one quote\n\n{PLAIN}\n  # end\n"),
        PLAIN.replace(',', ";"),
        PLAIN.replace(',', "\t"),
        PLAIN.replace(',', " , "),
        PLAIN.replace("time_s", "\"time_s\"").replace("0.6", "\"0.6\""),
        PLAIN.replace("-2\n", "-2"),
        PLAIN.replace("0.6", "+6e-1").replace("0.5", ".5"),
        // Some recorders end every row with a comma.
        PLAIN.replace("1\n", "1,\n"),
    ] {
        assert_eq!(read(&text, &[]).as_ref(), Ok(&plain), "{text:?}");
    }
}
