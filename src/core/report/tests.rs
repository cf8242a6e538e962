//! Reports as a whole: well-formed, escaped, small, the same each time.

use super::*;

/// Reads XML strictly: elements nest and close, attributes are quoted and occur once, text is escaped, ids are
/// unique and what refers to one finds it. Gives all text and attribute values, unescaped.
fn check_xml(xml: &str) -> String {
    let mut rest = xml.strip_prefix("<!DOCTYPE html>\n").unwrap_or(xml);
    let (mut open, mut ids, mut references) = (Vec::new(), Vec::new(), Vec::new());
    let (mut said, mut roots) = (String::new(), 0);
    while !rest.is_empty() {
        let Some(tag) = rest.strip_prefix('<') else {
            let end = rest.find('<').unwrap_or(rest.len());
            assert!(!open.is_empty() || rest[..end].trim().is_empty(), "text outside of the root");
            said += &unescaped(&rest[..end]);
            rest = &rest[end..];
            continue;
        };
        let end = tag.find('>').expect("a tag ends");
        let (inside, after) = (&tag[..end], &tag[end + 1..]);
        rest = after;
        if let Some(name) = inside.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "</{name}> closes something else");
            continue;
        }
        let (inside, is_leaf) = inside.strip_suffix('/').map_or((inside, false), |inside| (inside, true));
        let (name, mut attributes) = inside.split_once(' ').unwrap_or((inside, ""));
        assert!(name.chars().all(|c| c.is_ascii_alphanumeric()) && !name.is_empty(), "`{name}`");
        let mut keys = Vec::new();
        while !attributes.is_empty() {
            let (key, quoted) = attributes.split_once("=\"").expect("an attribute has a value");
            let (value, after) = quoted.split_once('"').expect("a value ends");
            assert!(!keys.contains(&key), "{key} twice");
            assert!(!value.contains('<'), "{value}");
            keys.push(key);
            let value = unescaped(value);
            match key {
                "id" => ids.push(value.clone()),
                "aria-labelledby" => references.extend(value.split(' ').map(str::to_owned)),
                "href" => references.push(value.strip_prefix('#').expect("links stay inside").to_owned()),
                _ => {}
            }
            said += &value;
            attributes = after.strip_prefix(' ').unwrap_or(after);
        }
        if !is_leaf {
            roots += usize::from(open.is_empty());
            open.push(name);
        }
    }
    assert!(open.is_empty(), "open: {open:?}");
    assert_eq!(roots, 1);
    let count = ids.len();
    ids.sort();
    ids.dedup();
    assert_eq!(ids.len(), count, "an id occurs twice");
    for reference in references {
        assert!(ids.contains(&reference), "no id {reference}");
    }
    said
}

fn unescaped(text: &str) -> String {
    let mut out = String::new();
    let mut pieces = text.split('&');
    out += pieces.next().unwrap();
    for piece in pieces {
        let (entity, after) = piece.split_once(';').expect("`&` begins an entity");
        out += match entity {
            "amp" => "&",
            "lt" => "<",
            "gt" => ">",
            "quot" => "\"",
            "#39" => "'",
            _ => panic!("unknown entity {entity}"),
        };
        out += after;
    }
    assert!(!out.chars().any(|c| c.is_control() && c != '\n' && c != '\t'), "control character");
    out
}

const NASTY: &str = "<script>alert(\"1\")</script> & 'x' ]]> \u{1b}[31m \u{0}";

fn chart(name: &str, points: Vec<[f64; 2]>) -> Chart {
    let panel = |unit| Panel {
        bands: vec![Band { name: format!("band of {name}"), x: Some([2.0, 3.0]), y: None }],
        limits: vec![Limit { name: format!("limit of {name}"), y: 0.5 }],
        ..Panel::new(
            Axis::new(name, unit),
            vec![
                Series::new(format!("line of {name}"), Mark::Line, points.clone()),
                Series::new(format!("steps of {name}"), Mark::Step, points.iter().copied().step_by(100)),
                Series::new(format!("dots of {name}"), Mark::Scatter, points.iter().copied().step_by(10)),
            ],
        )
    };
    Chart {
        title: name.to_owned(),
        description: format!("what there is to see of {name}"),
        x: Axis::new("Time", "s"),
        panels: vec![panel("m"), panel("rad")],
    }
}

fn wave(samples: usize) -> Vec<[f64; 2]> {
    (0..samples).map(|i| i as f64 * 60.0 / samples as f64).map(|t| [t, libm::sin(t)]).collect()
}

fn sample(words: &str) -> Document {
    let table = Table {
        caption: words.to_owned(),
        columns: vec![
            Column::new(words, ""),
            Column::grouped("ours", "x", "m"),
            Column::grouped("paper", words, "m"),
        ],
        rows: vec![
            vec![Cell::text(words), Cell::fixed(0.0645, 4), Cell::fixed(-1.5, 1)],
            vec![Cell::text("short"), Cell::fixed(12.0, 0), Cell::Empty],
        ],
        note: words.to_owned(),
    };
    Document {
        title: words.to_owned(),
        summary: words.to_owned(),
        blocks: vec![
            Block::section(words),
            Block::part(words),
            Block::paragraph(words),
            Block::notice(Tone::Warning, words, words),
            Block::section("second"),
            Block::List { numbered: true, items: vec![words.to_owned(); 2] },
            Block::section("third"),
            Block::Table(table),
            Block::Figure(chart(words, wave(500))),
            Block::Figure(chart("other", Vec::new())),
        ],
    }
}

#[test]
fn a_picture_has_the_size_that_is_asked_for_as_far_as_its_texts_allow() {
    let size = |asked: [f64; 2]| {
        let svg = chart("sized", wave(500)).to_svg_of(asked);
        check_xml(&svg);
        let (_, view) = svg.split_once("viewBox=\"0 0 ").unwrap();
        let (view, _) = view.split_once('"').unwrap();
        let mut sides = view.split(' ').map(|side| side.parse::<f64>().unwrap());
        [sides.next().unwrap(), sides.next().unwrap()]
    };
    assert_eq!(size([640.0, 480.0]), [640.0, 480.0]);
    assert_eq!(size([1600.0, 900.0]), [1600.0, 900.0]);
    let [width, height] = size([300.0, 1.0]);
    assert!(width == 300.0 && height < 400.0, "{height}");
    assert!(size([f64::NAN, 1e9])[1] <= 10_000.0);
}

/// Elements with their attributes.
fn elements(svg: &str) -> Vec<(String, std::collections::BTreeMap<String, String>)> {
    let tags = svg.split('<').skip(1).filter(|tag| !tag.starts_with('/'));
    let parsed = tags.map(|tag| {
        let tag = tag.split_once('>').expect("a tag ends").0.trim_end_matches('/');
        let (name, mut rest) = tag.split_once(' ').unwrap_or((tag, ""));
        let mut attributes = std::collections::BTreeMap::new();
        while let Some((key, value)) = rest.split_once("=\"") {
            let (value, behind) = value.split_once('"').expect("a value ends");
            let before = attributes.insert(key.trim().to_owned(), unescaped(value));
            assert!(before.is_none(), "{key} twice in {tag}");
            rest = behind;
        }
        (name.to_owned(), attributes)
    });
    parsed.collect()
}

#[test]
fn a_picture_needs_no_style_sheet() {
    let svg = chart("plain", wave(500)).to_svg_of([640.0, 480.0]);
    check_xml(&svg);
    assert!(!svg.contains("var(") && !svg.contains("<style") && !svg.contains("@media"), "{svg}");
    let all = elements(&svg);
    let root = &all[0].1;
    assert_eq!([&root["width"], &root["height"], &root["font-size"]], ["640", "480", "13px"]);
    assert_eq!([&root["fill"], &root["viewBox"]], ["#1c2126", "0 0 640 480"]);
    // Words begin inside the picture also where its font is wider than the one that was reckoned with.
    assert!(
        all.iter()
            .any(|(name, has)| name == "g" && has.get("transform").is_some_and(|by| by == "translate(10)"))
    );
    let is_colour = |value: &String| value.len() == 7 && value.starts_with('#');
    // A picture in a picture is not drawn by every program.
    assert_eq!(all.iter().filter(|(name, _)| name == "svg").count(), 1);
    let is_frame = |place: usize| place > 0 && all[place - 1].0 == "clipPath";
    for (_, (name, has)) in all.iter().enumerate().filter(|(place, _)| !is_frame(*place)) {
        let drawn = [has.get("stroke"), has.get("fill")].into_iter().flatten().any(is_colour);
        assert!(drawn || !["path", "rect"].contains(&name.as_str()), "{name} is not seen: {has:?}");
        // What is not filled must say so: black is what programs begin with.
        assert!(name != "path" || has.contains_key("fill"), "{has:?}");
    }
    let class = |class: &str| all.iter().find(|(_, has)| has.get("class").is_some_and(|of| of == class));
    let of = |class_name: &str, key: &str| class(class_name).and_then(|(_, has)| has.get(key)).cloned();
    assert_eq!(of("line s0", "stroke").as_deref(), Some("#0072b2"));
    assert_eq!(of("dots s2", "stroke-linecap").as_deref(), Some("round"));
    assert_eq!(of("limit l0", "stroke-dasharray").as_deref(), Some("8 4"));
    assert_eq!(of("band b0", "fill-opacity").as_deref(), Some("0.08"));
    assert_eq!(of("ty", "text-anchor").as_deref(), Some("end"));
    assert_eq!(of("axis tx", "font-weight").as_deref(), Some("600"));
}

#[test]
fn reports_are_well_formed_and_say_what_they_are_given() {
    for document in [sample("plain words"), sample(NASTY), Document::default()] {
        let said = check_xml(&document.to_html());
        assert!(said.contains(document.title.trim_end_matches(['\u{0}', ' ', 'm', '1', '3', '[', '\u{1b}'])));
    }
    check_xml(&chart("alone", wave(500)).to_svg());
}

#[test]
fn nothing_that_is_said_becomes_markup() {
    let html = sample(NASTY).to_html();
    assert!(!html.contains("<script"));
    assert!(!html.contains('\u{1b}') && !html.contains('\u{0}'));
    let text = sample(NASTY).to_text();
    assert!(text.contains("<script>alert"));
    assert!(!text.chars().any(|c| c.is_control() && c != '\n'));
}

#[test]
fn reports_need_nothing_from_outside() {
    let html = sample("plain words").to_html();
    let namespaces = html
        .replace("http://www.w3.org/1999/xhtml", "")
        .replace("http://www.w3.org/2000/svg", "")
        .replace("url(#", "");
    for word in ["http:", "https:", "src=", "url(", "@import", "<link", "<script"] {
        assert!(!namespaces.contains(word), "{word}");
    }
}

#[test]
fn long_recordings_stay_small() {
    let length = |samples| chart("x", wave(samples)).to_svg().len();
    assert!(length(60_000) < 80_000, "{}", length(60_000));
    assert!(length(600_000) < length(60_000) * 11 / 10);
}

#[test]
fn hardly_any_data_still_gives_a_chart() {
    let nan = f64::NAN;
    for points in [
        vec![],
        vec![[1.0, 2.0]],
        vec![[1.0, 2.0], [1.0, 2.0]],
        vec![[nan, nan]],
        vec![[0.0, 0.0], [5.0, 0.0]],
    ] {
        let svg = chart("x", points.clone()).to_svg();
        check_xml(&svg);
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{points:?}");
        let mut log = chart("x", points);
        log.panels[0].y.scale = Scale::Log;
        assert!(!log.to_svg().contains("NaN"));
    }
}

#[test]
fn marks_are_where_the_values_are() {
    let mut chart = chart("x", vec![[0.0, 0.0], [10.0, 1.0]]);
    chart.panels.truncate(1);
    chart.panels[0] = Panel::new(
        Axis { range: Some([0.0, 1.0]), ..Axis::new("y", "m") },
        vec![Series::new("line", Mark::Line, [[0.0, 0.0], [10.0, 1.0]])],
    );
    // One series needs no legend: below a margin of 4 is the axis title's line, 6 px below that the plot, 300 px tall;
    // left of it are labels of three characters and 12 px.
    let left = 3.0 * svg::CHARACTER + 12.0;
    let low = 4.0 + svg::LINE_HEIGHT + 6.0 + 300.0;
    let picture = chart.to_svg();
    let page = Document { title: String::new(), summary: String::new(), blocks: vec![Block::Figure(chart)] }
        .to_html();
    // A page has margins of its own, a picture has them inside.
    for (markup, margin) in [(picture, svg::MARGIN), (page, 0.0)] {
        let wide = svg::WIDE - 2.0 * margin - svg::RIGHT - left;
        let line = format!("d=\"M{left:.1} {low}l{wide:.1}-300\"");
        let (before, _) = markup.split_once(&line).unwrap_or_else(|| panic!("{line} is not in {markup}"));
        assert_eq!(before.contains(&format!("translate({margin})")), margin > 0.0);
    }
}

#[test]
fn tables_align_at_the_decimal_point() {
    let table = Table {
        caption: "Caption".to_owned(),
        columns: vec![
            Column::new("name", ""),
            Column::grouped("both", "x", "m"),
            Column::grouped("both", "y", ""),
        ],
        rows: vec![
            vec![Cell::text("a"), Cell::fixed(0.0645, 4), Cell::fixed(3.0, 0)],
            vec![Cell::text("bc"), Cell::fixed(-12.5, 1), Cell::Empty],
        ],
        note: String::new(),
    };
    let document =
        Document { title: "T".to_owned(), summary: String::new(), blocks: vec![Block::Table(table)] };
    let expected =
        "T\n=\n\nCaption\n      both\nname      x, m  y\n----  --------  -\na       0.0645  3\nbc    −12.5\n";
    assert_eq!(document.to_text(), expected);
    assert!(document.to_html().contains(">−12.5\u{2007}\u{2007}\u{2007}</td>"));
}

#[test]
fn text_keeps_to_its_width() {
    let words = "word ".repeat(100);
    let document = Document {
        title: "T".to_owned(),
        summary: words.clone(),
        blocks: vec![Block::List { numbered: false, items: vec![words] }],
    };
    assert!(document.to_text().lines().all(|line| line.chars().count() <= 100));
}
