//! The layout of a viewer (Foxglove, Lichtblick) that fits a run: its path in sight, its limits drawn, its drives where it has them.

use nalgebra::Vector3;
use serde_json::{Value, json};

use crate::parameters::AXIS_NAMES;

const GREY: &str = "#8c959f";
const RED: &str = "#e5402a";
/// Of X, Y and Z.
const AXIS_COLOURS: [&str; 3] = ["#2680eb", "#f5a623", "#2aa05a"];

/// What the layout is made for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LayoutOf {
    /// Lowest and highest coordinates of the desired path \[mm\].
    pub(crate) extent_mm: (Vector3<f64>, Vector3<f64>),
    /// The limit of the contouring error.
    pub(crate) contour_error_limit_um: Option<f64>,
    /// Voltage limits, axis by axis.
    pub(crate) voltage_limits_v: Vec<f64>,
    /// Whether there is a topic `/drives`.
    pub(crate) has_drives: bool,
}

/// The layout as a JSON document that the viewer imports.
pub(crate) fn layout(of: &LayoutOf) -> String {
    let axes = &AXIS_NAMES[..of.voltage_limits_v.len().min(AXIS_NAMES.len())];
    let each = |topic: &str, field: &str, unit: &str| -> Vec<Value> {
        let lines = axes.iter().zip(AXIS_COLOURS);
        lines
            .map(|(axis, colour)| line(&format!("{topic}.{axis}.{field}"), &format!("{axis} ({unit})"), colour))
            .collect()
    };
    let limits =
        |value: f64, label: &str| [value, -value].map(|value| reference(value, &format!("{label}, {value}"), RED));

    let mut contour = vec![line("/servo.contour_error_um", "contouring error (µm)", AXIS_COLOURS[0])];
    contour.extend(of.contour_error_limit_um.into_iter().flat_map(|limit| limits(limit, "limit (µm)")));
    let mut voltage = each("/servo", "voltage_v", "V");
    let mut known: Vec<f64> = Vec::new();
    for limit in of.voltage_limits_v.iter().copied().filter(|limit| limit.is_finite()) {
        if !known.contains(&limit) {
            known.push(limit);
            voltage.extend(limits(limit, "saturation (V)"));
        }
    }
    let mut position: Vec<Value> = Vec::new();
    for (axis, colour) in axes.iter().zip(AXIS_COLOURS) {
        position.push(line(&format!("/servo.{axis}.command_mm"), &format!("{axis} command (mm)"), GREY));
        position.push(line(&format!("/servo.{axis}.actual_mm"), &format!("{axis} actual (mm)"), colour));
    }
    let feed = vec![line("/servo.path.feed_mm_s", "feed (mm/s)", AXIS_COLOURS[2])];
    let acceleration = each("/servo", "setpoint_accel_mm_s2", "mm/s²");
    let jerk = each("/servo", "setpoint_jerk_mm_s3", "mm/s³");
    let tracking = vec![line("/servo.tracking_error_um", "tracking error (µm)", AXIS_COLOURS[0])];

    let mut panels = vec![
        ("3D!scene", scene(of)),
        ("RosOut!log", json!({ "searchTerms": [], "minLogLevel": 1, "topicToRender": "/log" })),
        ("Plot!contour", plot("Contouring error", "contouring error (µm)", &contour)),
        ("Plot!tracking", plot("Tracking error", "tracking error (µm)", &tracking)),
        ("Plot!position", plot("Command and actual position", "position (mm)", &position)),
        ("Plot!voltage", plot("Voltages", "voltage (V)", &voltage)),
        ("Plot!feed", plot("Feed", "feed (mm/s)", &feed)),
        ("Plot!acceleration", plot("Acceleration of the command", "acceleration (mm/s²)", &acceleration)),
        ("Plot!jerk", plot("Jerk of the command", "jerk (mm/s³)", &jerk)),
    ];
    let mut right = vec!["Plot!feed", "Plot!acceleration", "Plot!jerk"];
    if of.has_drives {
        panels.push(("Plot!torque", plot("Motor torque", "torque (N m)", &each("/drives", "motor_torque_nm", "N m"))));
        panels.push(("Plot!friction", plot("Friction", "torque (N m)", &each("/drives", "friction_nm", "N m"))));
        right = vec!["Plot!torque", "Plot!friction", "Plot!feed", "Plot!acceleration"];
        panels.retain(|(name, _)| *name != "Plot!jerk");
    }
    let panels: serde_json::Map<String, Value> =
        panels.into_iter().map(|(name, panel)| (name.to_owned(), panel)).collect();
    let left = column(&["Plot!contour", "Plot!tracking", "Plot!position", "Plot!voltage"]);
    let document = json!({
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": { "speed": 1 },
        "layout": {
            "direction": "row",
            "first": { "direction": "column", "first": "3D!scene", "second": "RosOut!log", "splitPercentage": 78 },
            "second": { "direction": "row", "first": left, "second": column(&right), "splitPercentage": 55 },
            "splitPercentage": 40
        }
    });
    // Values of JSON always have a text.
    serde_json::to_string_pretty(&document).unwrap_or_default() + "\n"
}

/// Panels one below the other, of the same height.
fn column(panels: &[&str]) -> Value {
    match panels {
        [] => Value::Null,
        [one] => json!(one),
        [first, rest @ ..] => json!({
            "direction": "column",
            "first": first,
            "second": column(rest),
            "splitPercentage": 100.0 / panels.len() as f64
        }),
    }
}

/// The path from above, all of it in sight; of three axes, turned so that the height is seen.
fn scene(of: &LayoutOf) -> Value {
    let (low, high) = of.extent_mm;
    let middle = (0.5 * (low + high)).map(|x| (1e6 * x).round() / 1e6);
    let size = (high - low).max().max(1e-3);
    let tilt_deg = if of.voltage_limits_v.len() > 2 { 50.0 } else { 0.0 };
    // About ten squares along the path, each a round number of millimetres.
    let grid = libm::pow(10.0, libm::round(libm::log10(0.1 * size)));
    let squares = (2.0 * size / grid).ceil().clamp(10.0, 100.0);
    json!({
        "cameraState": {
            "perspective": false,
            "distance": 1.4 * size,
            "phi": tilt_deg,
            "thetaOffset": 0,
            "targetOffset": [middle.x, middle.y, middle.z],
            "target": [0, 0, 0],
            "targetOrientation": [0, 0, 0, 1],
            "fovy": 45,
            "near": 1e-3 * size,
            "far": 100.0 * size
        },
        "followMode": "follow-none",
        "followTf": "servosim",
        "scene": {},
        "transforms": {},
        "topics": { "/path": { "visible": true }, "/trace": { "visible": true }, "/scene": { "visible": true } },
        "layers": {
            "grid": {
                "visible": true,
                "frameLocked": true,
                "label": format!("Grid, {grid} mm"),
                "instanceId": "grid",
                "layerId": "foxglove.Grid",
                "size": grid * squares,
                "divisions": squares,
                "lineWidth": 1,
                "color": "#8c959f55",
                "position": [middle.x, middle.y, low.z],
                "rotation": [0, 0, 0],
                "order": 1,
                "frameId": "servosim"
            }
        },
        "publish": {
            "type": "point",
            "poseTopic": "/move_base_simple/goal",
            "pointTopic": "/clicked_point",
            "poseEstimateTopic": "/initialpose",
            "poseEstimateXDeviation": 0.5,
            "poseEstimateYDeviation": 0.5,
            "poseEstimateThetaDeviation": 0.26
        },
        "imageMode": {},
        "foxglovePanelTitle": "Path and error (1 unit = 1 mm)",
        "lichtblickPanelTitle": "Path and error (1 unit = 1 mm)"
    })
}

fn plot(title: &str, y_label: &str, lines: &[Value]) -> Value {
    json!({
        "foxglovePanelTitle": title,
        "lichtblickPanelTitle": title,
        "paths": lines,
        "showLegend": true,
        "legendDisplay": "floating",
        "showPlotValuesInLegend": false,
        "showXAxisLabels": true,
        "showYAxisLabels": true,
        "isSynced": true,
        "xAxisVal": "timestamp",
        "sidebarDimension": 240,
        "xAxisLabel": "time (s)",
        "yAxisLabel": y_label
    })
}

fn line(value: &str, label: &str, colour: &str) -> Value {
    json!({
        "value": value,
        "enabled": true,
        "timestampMethod": "receiveTime",
        "label": label,
        "color": colour,
        "lineSize": 1.5
    })
}

fn reference(value: f64, label: &str, colour: &str) -> Value {
    json!({
        "value": value.to_string(),
        "enabled": true,
        "timestampMethod": "receiveTime",
        "label": label,
        "color": colour,
        "lineSize": 1.0
    })
}
