/** How finely to draw, so that the picture keeps up: fewer pixels where frames come slowly, all of them once it stands still. */

/** Frames that take longer are too slow, in milliseconds. */
const SLOW = 30;
/** Frames that take less allow more pixels. */
const FAST = 20;
/** So many of a kind, one after the other, change something; twice as many each time that more pixels were too many. */
const SLOW_FRAMES = 4, FAST_FRAMES = 90;
/** Milliseconds after which a picture that does not change is drawn at leisure. */
const REST = 500;

export class Quality {
  private level = 0;
  private slow = 0;
  private fast = 0;
  private patience = FAST_FRAMES;
  private last = -Infinity;

  /** `levels`: pixels of the picture for each pixel of the page, finest first; `still`: where nothing moves. */
  constructor(private readonly levels: readonly number[], readonly still: number) {}

  /** Pixels of the picture for each pixel of the page. */
  get ratio(): number {
    return this.levels[this.level];
  }

  /** A picture was begun at the time `start` and the page had its next turn at `next`, both in milliseconds. */
  took(start: number, next: number): void {
    this.last = start;
    const cost = next - start;
    this.slow = cost > SLOW ? this.slow + 1 : 0;
    this.fast = cost < FAST ? this.fast + 1 : 0;
    if (this.slow >= SLOW_FRAMES && this.level < this.levels.length - 1) {
      this.turn(1);
      this.patience *= 2;
    } else if (this.fast >= this.patience && this.level > 0) {
      this.turn(-1);
    }
  }

  private turn(by: number): void {
    this.level += by;
    this.slow = this.fast = 0;
  }

  /** Whether nothing has moved for so long that the picture may be drawn at leisure. */
  rests(now: number): boolean {
    return now - this.last > REST;
  }
}

/** Whether a renderer's name is that of a program without a graphics card. */
export function isSoftware(renderer: string): boolean {
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(renderer);
}

/** Name of the renderer of a canvas that is made for asking. */
export function rendererName(): string {
  const context = document.createElement('canvas').getContext('webgl2');
  const about = context?.getExtension('WEBGL_debug_renderer_info');
  const name = context ? String(context.getParameter(about ? about.UNMASKED_RENDERER_WEBGL : context.RENDERER)) : '';
  context?.getExtension('WEBGL_lose_context')?.loseContext();
  return name;
}
