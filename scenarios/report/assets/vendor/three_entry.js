// The parts of three.js that scene.js uses, as window.tlpsimThree. `three.bundle.min.js` is made from this file, in a
// folder where `npm install --no-save three@0.187.0 esbuild@0.28.2` was run:
//
//   NODE_PATH=node_modules npx esbuild PATH/TO/three_entry.js --bundle --minify --format=iife \
//     --global-name=tlpsimThree --charset=utf8 --legal-comments=inline --target=es2022 --outfile=three.bundle.min.js
export {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CanvasTexture,
  Color,
  ConeGeometry,
  CylinderGeometry,
  DirectionalLight,
  DoubleSide,
  DynamicDrawUsage,
  Group,
  HemisphereLight,
  Line,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  MeshPhongMaterial,
  PerspectiveCamera,
  Scene,
  Sprite,
  SpriteMaterial,
  Vector3,
  WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
