/** How far to step next, so that simulated time follows the wall clock. */

/** Longest piece of simulated time asked for at once, as wall time in seconds; of a tab that nobody sees: browsers let it go on once a minute. */
const LONGEST = 0.1, LONGEST_HIDDEN = 61;

export class Pace {
  private origin: { wall: number; time: number };

  constructor(private readonly speed: number, wall: number, time: number) {
    this.origin = { wall, time };
  }

  /**
   * Time to step to, or nothing while the next step is not due. A simulation that is too slow is not chased, one that others took on not waited for.
   * `held`: for so long the browser held up a tab that nobody sees.
   */
  next(wall: number, time: number, step: number, held = 0): number | undefined {
    let target = this.origin.time + (wall - this.origin.wall) * this.speed;
    const longest = Math.max(Math.max(LONGEST, Math.min(held, LONGEST_HIDDEN)) * this.speed, step);
    if (target - time > longest) {
      this.origin = { wall, time: time + longest };
      target = this.origin.time;
    }
    if (time - target > longest) {
      this.origin = { wall, time };
      target = time;
    }
    const due = target - time >= step * 0.5;
    return due ? Math.max(target, time + step) : undefined;
  }
}
