// A model as three.js shows it: lit by an environment and by the file's own lights, with the tone curve of Khronos.
//   window.beside.load({ model, environment, sidePx })   gives the camera: { eye, target, fov_y_deg }
//   window.beside.picture(background)                    gives a PNG on a background of three sRGB bytes
//   window.beside.finePicture(background)                gives the same from 16 shaded samples a pixel, not one
//   window.beside.covered()                              gives a PNG that is white where anything of the model shows
// Pictures are data URLs.
import * as THREE from 'three';
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { HDRLoader } from 'three/addons/loaders/HDRLoader.js';
import { KTX2Loader } from 'three/addons/loaders/KTX2Loader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';

const FOV_Y_DEG = 40;
// Where the eye stands, as seen from the model's middle; files look along +z.
const [AZIMUTH_RAD, ELEVATION_RAD] = [Math.PI / 6, Math.PI / 9];
// What the model takes of the view's sides at most, by this many of its vertices.
const FILLS = 2 / 3;
const VERTICES = 20_000;
// Samples a pixel of the fine picture, along either side.
const FINE = 4;

let shown;

async function load({ model, environment, sidePx }) {
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true });
  renderer.setPixelRatio(1);
  renderer.setSize(sidePx, sidePx);
  renderer.outputColorSpace = THREE.SRGBColorSpace;
  renderer.toneMapping = THREE.NeutralToneMapping;
  renderer.toneMappingExposure = 1;
  document.body.append(renderer.domElement);
  const gltf = await loader(renderer).loadAsync(model);
  standAtTimeZero(gltf);
  const scene = new THREE.Scene();
  scene.add(gltf.scene);
  scene.environment = await filtered(renderer, environment);
  scene.updateMatrixWorld(true);
  const camera = cameraFor(new THREE.Box3().setFromObject(gltf.scene, true), outerPoints(gltf.scene));
  shown = { renderer, scene, camera: camera.three };
  return camera.written;
}

function loader(renderer) {
  const draco = new DRACOLoader().setDecoderPath('/three/examples/jsm/libs/draco/gltf/');
  const ktx2 = new KTX2Loader().setTranscoderPath('/three/examples/jsm/libs/basis/').detectSupport(renderer);
  return new GLTFLoader().setDRACOLoader(draco).setKTX2Loader(ktx2).setMeshoptDecoder(MeshoptDecoder);
}

async function filtered(renderer, environment) {
  const picture = await (environment.endsWith('.exr') ? new EXRLoader() : new HDRLoader()).loadAsync(environment);
  picture.mapping = THREE.EquirectangularReflectionMapping;
  return new THREE.PMREMGenerator(renderer).fromEquirectangular(picture).texture;
}

/** All clips where no two move one node, otherwise the first: as the server plays them. */
function standAtTimeZero({ animations, scene }) {
  const targets = animations.map((clip) => new Set(clip.tracks.map((track) => track.name.replace(/\.[^.]*$/, ''))));
  const all = targets.flatMap((nodes) => [...nodes]);
  const playing = new Set(all).size === all.length ? animations : animations.slice(0, 1);
  const mixer = new THREE.AnimationMixer(scene);
  playing.forEach((clip) => mixer.clipAction(clip).play());
  mixer.setTime(0);
}

/** Vertices of all that is drawn, evenly picked; of what is drawn many times, corners of a box around it. */
function outerPoints(scene) {
  const drawn = [];
  scene.traverse((object) => object.geometry && drawn.push(object));
  const total = drawn.reduce((sum, { geometry }) => sum + geometry.attributes.position.count, 0);
  const step = Math.ceil(total / VERTICES);
  return drawn.flatMap((object) => {
    if (object.isInstancedMesh) return corners(new THREE.Box3().setFromObject(object));
    const points = [];
    for (let index = 0; index < object.geometry.attributes.position.count; index += step) {
      const point = new THREE.Vector3().fromBufferAttribute(object.geometry.attributes.position, index);
      points.push((object.getVertexPosition?.(index, point) ?? point).applyMatrix4(object.matrixWorld));
    }
    return points;
  });
}

const corners = (box) => [0, 1, 2, 3, 4, 5, 6, 7].map((bits) => new THREE.Vector3(
  box[bits & 1 ? 'max' : 'min'].x, box[bits & 2 ? 'max' : 'min'].y, box[bits & 4 ? 'max' : 'min'].z));

/** Looks at the middle of a box from so far that the points fill their share of the view. */
function cameraFor(box, points) {
  const [middle, radius] = [box.getCenter(new THREE.Vector3()), box.getSize(new THREE.Vector3()).length() / 2 || 1];
  const level = Math.cos(ELEVATION_RAD);
  const back = new THREE.Vector3(level * Math.sin(AZIMUTH_RAD), Math.sin(ELEVATION_RAD), level * Math.cos(AZIMUTH_RAD));
  const at = (distance) => {
    const three = new THREE.PerspectiveCamera(FOV_Y_DEG, 1, distance / 100, distance + 2 * radius);
    three.position.copy(middle).addScaledVector(back, distance);
    three.lookAt(middle);
    three.updateMatrixWorld();
    return three;
  };
  const fills = (distance) => {
    const three = at(distance);
    const seen = new THREE.Vector3();
    return points.reduce((most, point) => {
      seen.copy(point).project(three);
      return Math.max(most, Math.abs(seen.x), Math.abs(seen.y));
    }, 0);
  };
  // All of the model lies before an eye at the first of these.
  let [near, far] = [radius * 1.01, radius * 100];
  for (let halving = 0; halving < 40; halving += 1) {
    const between = (near + far) / 2;
    if (fills(between) > FILLS) near = between;
    else far = between;
  }
  const three = at(far);
  three.near = Math.max(far - 1.01 * radius, far / 1000);
  three.updateProjectionMatrix();
  return { three, written: { eye: three.position.toArray(), target: middle.toArray(), fov_y_deg: FOV_Y_DEG } };
}

function picture(background) {
  draw(background);
  return shown.renderer.domElement.toDataURL('image/png');
}

function draw(background) {
  const { renderer, scene, camera } = shown;
  renderer.setClearColor(new THREE.Color(`rgb(${background.join(',')})`), 1);
  renderer.render(scene, camera);
}


/** The same, each pixel the mean light of FINE x FINE of its own. */
function finePicture(background) {
  const { renderer } = shown;
  const { width, height } = renderer.domElement;
  renderer.setPixelRatio(FINE);
  draw(background);
  const { data, width: fineWidth } = pixels();
  renderer.setPixelRatio(1);
  const mean = new ImageData(width, height);
  for (let index = 0; index < width * height; index += 1) {
    const [x, y] = [(index % width) * FINE, Math.floor(index / width) * FINE];
    for (let channel = 0; channel < 3; channel += 1) {
      let light = 0;
      for (let step = 0; step < FINE * FINE; step += 1) {
        light += LIGHT[data[4 * ((y + Math.floor(step / FINE)) * fineWidth + x + (step % FINE)) + channel]];
      }
      mean.data[4 * index + channel] = 255 * encoded(light / (FINE * FINE));
    }
    mean.data[4 * index + 3] = 255;
  }
  return png(mean);
}

/** Linear light of each sRGB byte. */
const LIGHT = Float64Array.from({ length: 256 }, (_, byte) => (byte <= 10 ? byte / 255 / 12.92 : ((byte / 255 + 0.055) / 1.055) ** 2.4));
const encoded = (light) => (light <= 0.0031308 ? 12.92 * light : 1.055 * light ** (1 / 2.4) - 0.055);

function covered() {
  const { renderer, scene, camera } = shown;
  renderer.setClearColor(0x000000, 0);
  renderer.render(scene, camera);
  const mask = pixels();
  for (let index = 0; index < mask.data.length; index += 4) mask.data.set(mask.data[index + 3] > 0 ? [255, 255, 255, 255] : [0, 0, 0, 255], index);
  return png(mask);
}

/** What was drawn last, the upper row first. */
function pixels() {
  const gl = shown.renderer.getContext();
  const [width, height] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const rows = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, rows);
  const picture = new ImageData(width, height);
  // Rows of WebGL begin below.
  for (let y = 0; y < height; y += 1) picture.data.set(rows.subarray(4 * width * (height - 1 - y), 4 * width * (height - y)), 4 * width * y);
  return picture;
}

function png(picture) {
  const canvas = document.createElement('canvas');
  [canvas.width, canvas.height] = [picture.width, picture.height];
  canvas.getContext('2d').putImageData(picture, 0, 0);
  return canvas.toDataURL('image/png');
}

window.beside = { load, picture, finePicture, covered };
