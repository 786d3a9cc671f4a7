/** Colours of values between the least and the largest seen, of all that share the scale. */
import type * as THREE from 'three';

export class ValueScale {
  private least = Infinity;
  private largest = -Infinity;

  constructor(private readonly low: THREE.Color, private readonly high: THREE.Color) {}

  /** Leaves `out` as it is where the value is not known; the middle where all are equal. */
  colour(value: number, out: THREE.Color): void {
    if (!Number.isFinite(value)) return;
    this.least = Math.min(this.least, value);
    this.largest = Math.max(this.largest, value);
    const range = this.largest - this.least;
    out.lerpColors(this.low, this.high, range > 0 ? (value - this.least) / range : 0.5);
  }
}
