/** Colours of the scene, light and dark. They differ in brightness too, for eyes that tell colours less well. */

export interface Palette {
  background: string;
  grid: string;
  node: string;
  link: string;
  body: string;
  joint: string;
  beam: string;
  section: string;
  spring: string;
  hydraulic: string;
  /** Lowest and highest pressure. */
  low: string;
  high: string;
  shell: string;
  force: string;
  moment: string;
  reaction: string;
  flexible: string;
  strained: string;
  velocity: string;
  /** Axes. */
  x: string;
  y: string;
  z: string;
  other: string;
  trail: string;
  selected: string;
}

export const DARK: Palette = {
  background: '#10151c',
  grid: '#52647a',
  node: '#e6edf3',
  link: '#7d8b99',
  body: '#6f93b8',
  joint: '#f0a13c',
  beam: '#35c2a8',
  section: '#b9f0e4',
  spring: '#c9b458',
  hydraulic: '#d86f9a',
  low: '#3f6fd8',
  high: '#ff5a5a',
  shell: '#4fa8d8',
  force: '#ff5c5c',
  moment: '#b980ff',
  reaction: '#ff9f6b',
  flexible: '#5cb8ff',
  strained: '#ffb347',
  velocity: '#4fd1c5',
  x: '#ff6b70',
  y: '#4cc38a',
  z: '#5aa2ff',
  other: '#9aa7b4',
  trail: '#ffd166',
  selected: '#ffe14d',
};

export const LIGHT: Palette = {
  background: '#f3f6f9',
  grid: '#8fa2b4',
  node: '#1c2733',
  link: '#7c8894',
  body: '#5f86ad',
  joint: '#c96f00',
  beam: '#00836c',
  section: '#00473b',
  spring: '#8a7400',
  hydraulic: '#b8336a',
  low: '#2456c4',
  high: '#cf1d1d',
  shell: '#1f7fb8',
  force: '#cf2222',
  moment: '#7a3fd0',
  reaction: '#c8602a',
  flexible: '#1469b8',
  strained: '#c44f00',
  velocity: '#007f86',
  x: '#c62a2f',
  y: '#18794e',
  z: '#0b5cc4',
  other: '#6a7785',
  trail: '#b07a00',
  selected: '#d6006c',
};
