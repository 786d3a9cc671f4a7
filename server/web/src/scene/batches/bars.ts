/** Round bars between points, such as barrel and rod of an actuator. */
import * as THREE from 'three';
import type { Pose } from '../../geometry';
import type { Points } from '../points';
import { Instances } from './instances';
import { writeBar } from './matrices';

export interface BarItem {
  id: string;
  from: number;
  to: number;
  /** Where the bar begins and ends, as lengths from the first point, when the points are `length` apart. */
  span(length: number): readonly [number, number];
  radius: number;
  /** Its colour as it moves; absent: that of the batch. */
  colour?(pose: Pose, out: THREE.Color): void;
}

const BAR = new THREE.CylinderGeometry(1, 1, 1, 24).translate(0, 0.5, 0);
const direction = [0, 0, 0], start = [0, 0, 0], tint = new THREE.Color();

export class BarBatch extends Instances {
  private selected?: string;

  constructor(private readonly items: BarItem[], private readonly points: Points, colour: THREE.Color, opacity = 1) {
    super(BAR, items.map((item) => item.id), colour, opacity);
  }

  update(pose: Pose): void {
    const x = this.points.x;
    this.items.forEach(({ from, to, span, radius }, i) => {
      for (let k = 0; k < 3; ++k) direction[k] = x[3 * to + k] - x[3 * from + k];
      const length = Math.hypot(direction[0], direction[1], direction[2]);
      for (let k = 0; k < 3; ++k) direction[k] = length > 0 ? direction[k] / length : Number(k === 2);
      const [begin, end] = span(length);
      for (let k = 0; k < 3; ++k) start[k] = x[3 * from + k] + begin * direction[k];
      writeBar(this.matrices, 16 * i, start, direction, Math.max(end - begin, 0), radius);
    });
    this.solids.moved();
    this.tint(pose);
  }

  private tint(pose: Pose): void {
    this.items.forEach((item, i) => {
      if (!item.colour || item.id === this.selected) return;
      item.colour(pose, tint.copy(this.colour));
      this.solids.paint(i, tint);
    });
  }

  highlight(id: string | undefined, selected: THREE.Color): void {
    this.selected = id;
    super.highlight(id, selected);
  }
}
