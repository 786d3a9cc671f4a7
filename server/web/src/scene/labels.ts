/** Names beside nodes and elements, as text over the picture. */
import * as THREE from 'three';
import type { Geometry, Pose } from '../geometry';
import { Points } from './points';

/** More than so many are not drawn: nobody could read them. */
const MOST = 120;

export class Labels {
  readonly element = document.createElement('div');
  private readonly points: Points;
  private entries: { point: number; text: HTMLElement }[] = [];
  private readonly at = new THREE.Vector3();

  constructor(geometry: Geometry) {
    this.element.className = 'labels';
    this.element.setAttribute('aria-hidden', 'true');  // the tree says the same
    this.points = new Points(geometry.nodes.length);
    const wanted = geometry.nodes.map((node, point) => ({ point, kind: 'node', text: node.name || String(node.label) }));
    for (const element of geometry.elements)
      if (element.points.length > 0) wanted.push({ point: this.points.add(element.points[0]), kind: 'element', text: element.name || `${element.type || element.family} ${element.label}` });
    const drawn = wanted.length > MOST ? wanted.filter(({ kind }) => kind === 'node') : wanted;
    if (drawn.length > MOST) return;
    const rows = new Map<number, number>();
    for (const { point, kind, text } of drawn) {
      const entry = document.createElement('span'), row = rows.get(point) ?? 0;
      entry.className = kind;
      entry.textContent = text;
      entry.style.marginTop = `${14 * row}px`;  // what stands at one point is listed
      rows.set(point, row + 1);
      this.element.append(entry);
      this.entries.push({ point, text: entry });
    }
  }

  move(pose: Pose): void {
    this.points.update(pose);
  }

  /** Puts each where the camera sees it. */
  place(camera: THREE.Camera, width: number, height: number): void {
    const x = this.points.x;
    for (const { point, text } of this.entries) {
      const at = this.at.set(x[3 * point], x[3 * point + 1], x[3 * point + 2]).project(camera);
      text.style.display = Math.abs(at.z) < 1 ? '' : 'none';
      text.style.transform = `translate(${((at.x + 1) / 2) * width + 8}px, ${((1 - at.y) / 2) * height - 16}px)`;
    }
  }
}
