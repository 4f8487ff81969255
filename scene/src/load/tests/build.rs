//! Makes GLB files.

use serde_json::{Value, json};

/// A document and its buffer, while they are made.
pub(super) struct Builder {
    pub json: Value,
    bin: Vec<u8>,
}

pub(super) const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

impl Builder {
    /// One node, 0, that shows a mesh of the given positions, accessor 0.
    pub fn of_positions(positions: &[f32]) -> Builder {
        let mut builder = Builder {
            json: json!({
                "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
                "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}],
            }),
            bin: Vec::new(),
        };
        builder.floats(positions, "VEC3");
        builder
    }

    /// Adds a view of raw bytes and gives its index.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    /// Adds an accessor of its own view and gives its index.
    pub fn accessor(&mut self, bytes: &[u8], component: u32, shape: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({"bufferView": view, "componentType": component, "type": shape, "count": count}))
    }

    pub fn floats(&mut self, values: &[f32], shape: &str) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        self.accessor(bytemuck::cast_slice(values), 5126, shape, values.len() / width)
    }

    pub fn push(&mut self, section: &str, value: Value) -> usize {
        if self.json[section].is_null() {
            self.json[section] = json!([]);
        }
        let array = self.json[section].as_array_mut().unwrap();
        array.push(value);
        array.len() - 1
    }

    /// Animates a property of node 0.
    pub fn animate(&mut self, path: &str, interpolation: &str, times: &[f32], values: &[f32], shape: &str) {
        let (input, output) = (self.floats(times, "SCALAR"), self.floats(values, shape));
        self.push(
            "animations",
            json!({
                "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}],
                "samplers": [{"input": input, "output": output, "interpolation": interpolation}],
            }),
        );
    }

    pub fn glb(mut self) -> Vec<u8> {
        self.json["buffers"][0]["byteLength"] = self.bin.len().into();
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut glb = b"glTF".to_vec();
        let length = 12 + 8 + text.len() + 8 + self.bin.len();
        for word in [2, length as u32, text.len() as u32] {
            glb.extend_from_slice(&word.to_le_bytes());
        }
        glb.extend_from_slice(b"JSON");
        glb.extend_from_slice(&text);
        glb.extend_from_slice(&(self.bin.len() as u32).to_le_bytes());
        glb.extend_from_slice(b"BIN\0");
        glb.extend_from_slice(&self.bin);
        glb
    }
}
