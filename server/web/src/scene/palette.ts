/** Colours of the scene, light and dark. They differ in brightness too, for eyes that tell colours less well. */

export interface Palette {
  background: string;
  grid: string;
  node: string;
  link: string;
  body: string;
  joint: string;
  beam: string;
  spring: string;
  hydraulic: string;
  shell: string;
  force: string;
  moment: string;
  reaction: string;
  flexible: string;
  strained: string;
  velocity: string;
  other: string;
  trail: string;
  selected: string;
}

export const DARK: Palette = {
  background: '#10151c',
  grid: '#27313d',
  node: '#e6edf3',
  link: '#7d8b99',
  body: '#6f93b8',
  joint: '#f0a13c',
  beam: '#35c2a8',
  spring: '#c9b458',
  hydraulic: '#d86f9a',
  shell: '#4fa8d8',
  force: '#ff5c5c',
  moment: '#b980ff',
  reaction: '#ff9f6b',
  flexible: '#5cb8ff',
  strained: '#ffb347',
  velocity: '#4fd1c5',
  other: '#9aa7b4',
  trail: '#ffd166',
  selected: '#ffe14d',
};

export const LIGHT: Palette = {
  background: '#f3f6f9',
  grid: '#cdd7e0',
  node: '#1c2733',
  link: '#7c8894',
  body: '#5f86ad',
  joint: '#c96f00',
  beam: '#00836c',
  spring: '#8a7400',
  hydraulic: '#b8336a',
  shell: '#1f7fb8',
  force: '#cf2222',
  moment: '#7a3fd0',
  reaction: '#c8602a',
  flexible: '#1469b8',
  strained: '#c44f00',
  velocity: '#007f86',
  other: '#6a7785',
  trail: '#b07a00',
  selected: '#d6006c',
};
