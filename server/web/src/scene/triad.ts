/** The axes in the corner: x red, y green, z blue, in one call. */
import * as THREE from 'three';
import { mergeGeometries } from 'three/examples/jsm/utils/BufferGeometryUtils.js';

const AXES: [THREE.Vector3, string][] = [
  [new THREE.Vector3(1, 0, 0), '#e5484d'],
  [new THREE.Vector3(0, 1, 0), '#30a46c'],
  [new THREE.Vector3(0, 0, 1), '#3e8bff'],
];

export function triad(): THREE.Scene {
  const scene = new THREE.Scene();
  const arrows = AXES.map(([axis, colour]) => {
    const arrow = mergeGeometries([
      new THREE.CylinderGeometry(0.035, 0.035, 0.7, 12).translate(0, 0.35, 0),
      new THREE.ConeGeometry(0.1, 0.25, 16).translate(0, 0.8, 0),
    ]);
    arrow.applyQuaternion(new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), axis));
    const { r, g, b } = new THREE.Color(colour), count = arrow.attributes.position.count;
    arrow.setAttribute('color', new THREE.Float32BufferAttribute(Array.from({ length: count }, () => [r, g, b]).flat(), 3));
    return arrow;
  });
  scene.add(new THREE.Mesh(mergeGeometries(arrows), new THREE.MeshBasicMaterial({ vertexColors: true })));
  return scene;
}
