/** Colours of values between the least and the largest seen, of all that share the scale. */
import type * as THREE from 'three';

export class ValueScale {
  private least = Infinity;
  private largest = -Infinity;

  /** `alone`: where between the ends a value stands that is the only one seen. */
  constructor(readonly low: THREE.Color, readonly high: THREE.Color, private readonly alone = 0.5) {}

  /** Forgets what was seen. */
  forget(): void {
    this.least = Infinity;
    this.largest = -Infinity;
  }

  /** The least and the largest value seen; nothing: none was. */
  get range(): [number, number] | undefined {
    return this.least <= this.largest ? [this.least, this.largest] : undefined;
  }

  /** Leaves `out` as it is where the value is not known; `alone` where all are equal. */
  colour(value: number, out: THREE.Color): void {
    if (!Number.isFinite(value)) return;
    this.least = Math.min(this.least, value);
    this.largest = Math.max(this.largest, value);
    const range = this.largest - this.least;
    out.lerpColors(this.low, this.high, range > 0 ? (value - this.least) / range : this.alone);
  }
}
