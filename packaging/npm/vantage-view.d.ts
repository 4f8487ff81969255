// What there is to set, to call and to hear of <vantage-view>. Lengths are in metres, y is up.

/** A point: x, y, z. */
export type Point = readonly [number, number, number];

/** What an element shows. */
export interface VantageState {
  /** Whether a picture of the scene has been drawn. */
  readonly picture: boolean;
  /** Whether there is a session with the server. */
  readonly connected: boolean;
  /** What is wrong, in words for a person; empty where nothing is. */
  readonly status: string;
  /** The scene's name. */
  readonly scene: string;
  /** The eye, which looks along +z of its own space; null before there is one. */
  readonly pose: { readonly position: Point; readonly quaternion: readonly [number, number, number, number] } | null;
  readonly mode: 'walk' | 'turn' | null;
  /** Whether the view of an eye that stands still is there as a whole. */
  readonly atRest: boolean;
  /** Samples that are held. */
  readonly samples: number;
  readonly picturesPerSecond: number;
  readonly megabitPerSecond: number;
}

/** How a scene is put before a view, which others need not share. */
export interface VantageStaging {
  /** Whether the scene moves, and begins again. */
  readonly motion: 'still' | 'endless' | 'loop';
  /** After so many seconds; null where it does not. */
  readonly period: number | null;
  /** The scene's time, in seconds; null before it is known. */
  readonly time: number | null;
  /** How many times as fast as the clock it goes. */
  readonly rate: number;
  /** Whether all objects are shown, all but some, or some alone. */
  readonly which: 'all' | 'but' | 'only';
  /** Those, with their names as far as they are known. */
  readonly objects: readonly { readonly object: number; readonly name: string | null }[];
  /** What lies beyond this plane is cut off; null where nothing is. */
  readonly section: { readonly normal: Point; readonly offset: number } | null;
}

export interface VantageEventMap {
  /** The first picture of what is loaded is there. */
  ready: Event;
  /** Something else is shown, at most ten times a second. */
  change: CustomEvent<VantageState>;
  /** Nothing is shown, and why. */
  error: CustomEvent<string>;
}

/**
 * Attributes: `src`, the server's address (wss://host/ws, or that of its page); `token`, what it must be told, where it asks for that; and what the server's page takes in its own address:
 * `scene`, within its file `file-scene` and `variant`, `eye` and `target` ("x,y,z"), `mode` ("walk" or "turn"), `fov` (degrees), `exposure` (stops), `renderer` ("webgpu" or "webgl2"), `shadows`, `occlusion`, `antialias`, `camera`,
 * `present`, `follow`, `time` (seconds, where it stops) or `rate`, `hide` or `only` (numbers of objects, with commas between them), `cut` ("x,y,z,metres"), and `bare`, without figures and buttons. A change of any loads anew.
 */
export class VantageViewElement extends HTMLElement {
  src: string;
  readonly state: VantageState | null;
  /** Goes to where a point is seen from another. */
  goTo(view: { eye: Point; target: Point }): Promise<void>;
  /** A PNG of the view as it is now, of any size up to 7,680 pixels a side; without one as large as the element. */
  picture(size?: { width?: number; height?: number }): Promise<Blob>;
  /** The address of the view as it is now, for another browser. */
  link(): Promise<string>;
  /** The scene's time goes on so many times as fast from now on, for this view alone: once without a number; 0 stops it. */
  play(rate?: number): Promise<void>;
  pause(): Promise<void>;
  /** The scene's time is this one now, in seconds. */
  seek(time: number): Promise<void>;
  /** All of the scene's objects but these are shown; all without any. */
  hide(...objects: number[]): Promise<void>;
  /** These objects alone are shown; all without any. */
  showOnly(...objects: number[]): Promise<void>;
  /** Nothing is shown that lies farther along a normal than so many metres from the origin; all is without one. */
  cut(plane?: { normal: Point; offset: number }): Promise<void>;
  /** How the scene is put before this view now. */
  staging(): Promise<VantageStaging>;
  addEventListener<K extends keyof VantageEventMap>(type: K, listener: (event: VantageEventMap[K]) => void, options?: boolean | AddEventListenerOptions): void;
  addEventListener(type: string, listener: EventListenerOrEventListenerObject, options?: boolean | AddEventListenerOptions): void;
}

declare global {
  interface HTMLElementTagNameMap {
    'vantage-view': VantageViewElement;
  }
}
