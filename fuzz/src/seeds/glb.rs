//! Makes small GLB files.

use serde_json::{Value, json};

/// A document and its buffer, while they are made.
pub struct Builder {
    pub json: Value,
    buffer: Vec<u8>,
}

impl Builder {
    /// Two triangles with normals and texture coordinates: accessors 0 to 3, mesh 0, node 0.
    pub fn quad() -> Builder {
        let mut builder = Builder {
            json: json!({
                "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "quad"}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2}, "indices": 3}]}],
                "accessors": [], "bufferViews": [], "buffers": [{"byteLength": 0}],
            }),
            buffer: Vec::new(),
        };
        builder.floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0], "VEC3");
        builder.floats(&[0.0, 0.0, 1.0].repeat(4), "VEC3");
        builder.floats(&[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0], "VEC2");
        builder.accessor(&[0, 1, 2, 0, 2, 3], 5121, "SCALAR", 6);
        builder
    }

    /// Adds to an array of the document; gives the place.
    pub fn push(&mut self, section: &str, value: Value) -> usize {
        if self.json[section].is_null() {
            self.json[section] = json!([]);
        }
        let array = self.json[section].as_array_mut().expect("sections are arrays");
        array.push(value);
        array.len() - 1
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.buffer.len(), "byteLength": bytes.len()});
        self.buffer.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

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
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, shape, values.len() / width)
    }

    /// The attributes of the mesh.
    pub fn attribute(&mut self, name: &str, accessor: usize) {
        self.json["meshes"][0]["primitives"][0]["attributes"][name] = accessor.into();
    }

    /// Animates a property of node 0 over a second.
    pub fn animate(&mut self, path: &str, interpolation: &str, values: &[f32], shape: &str) {
        let input = self.floats(&[0.0, 1.0], "SCALAR");
        let output = self.floats(values, shape);
        let channel = json!({"sampler": 0, "target": {"node": 0, "path": path}});
        let sampler = json!({"input": input, "output": output, "interpolation": interpolation});
        self.push("animations", json!({"channels": [channel], "samplers": [sampler]}));
    }

    pub fn glb(mut self) -> Vec<u8> {
        self.buffer.resize(self.buffer.len().next_multiple_of(4), 0);
        self.json["buffers"][0]["byteLength"] = self.buffer.len().into();
        let mut text = self.json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<u8>>();
        let length = 12 + 8 + text.len() + 8 + self.buffer.len();
        [
            b"glTF".to_vec(),
            words(&[2, length as u32, text.len() as u32]),
            b"JSON".to_vec(),
            text,
            words(&[self.buffer.len() as u32]),
            b"BIN\0".to_vec(),
            self.buffer,
        ]
        .concat()
    }
}
