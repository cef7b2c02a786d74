
// ---- charts: lines over time and bars, as SVG ----------------------------------------------------------------

const SVG = 'http://www.w3.org/2000/svg';
const CHART_HEIGHT = 190;
const MARGIN = { top: 8, right: 12, bottom: 22 };
const DIGIT_WIDTH = 7;

function shape(name, attributes, text) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

// A figure with a title, a key for each series, and room for a drawing.
function figure(title, names) {
  const node = element('figure');
  const caption = node.appendChild(element('figcaption'));
  caption.appendChild(element('strong', '', title));
  const keys = names.map((name, index) => {
    const key = caption.appendChild(element('span', `key s${index}`, name));
    return key;
  });
  const svg = node.appendChild(shape('svg', { role: 'img', 'aria-label': title }));
  return { node, svg, keys, title };
}

// Where a scale from low to high has its lines, and with how many digits.
function scale(low, high, most) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const ticks = [];
  for (let at = Math.ceil(low / step - 1e-9); at * step <= high + step * 1e-9; at += 1) ticks.push(at * step);
  return { ticks, digits };
}

// The least and the greatest value, at least so far apart.
function extent(series, least) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of series) {
    for (const value of values) {
      if (value === null) continue;
      low = Math.min(low, value);
      high = Math.max(high, value);
    }
  }
  if (low > high) [low, high] = [0, 0];
  const room = Math.max((least - (high - low)) / 2, (high - low) * 0.05);
  return [low - room, high + room];
}

// Lines over the last `span` seconds. A value that is null, or a pause of several samples, leaves a gap.
function drawLines(chart, { times, series, span, period, least, unit }) {
  const width = Math.max(chart.node.clientWidth, 200);
  const [low, high] = extent(series, least);
  const { ticks, digits } = scale(low, high, 5);
  const labels = ticks.map((tick) => tick.toFixed(digits).replace('-', '\u2212'));
  const left = 8 + DIGIT_WIDTH * Math.max(...labels.map((label) => label.length), 2);
  const [right, bottom] = [width - MARGIN.right, CHART_HEIGHT - MARGIN.bottom];
  const newest = times.length ? times[times.length - 1] : 0;
  const x = (time) => right - (newest - time) / span * (right - left);
  const y = (value) => bottom - (value - low) / (high - low) * (bottom - MARGIN.top);
  const nodes = [];
  ticks.forEach((tick, index) => {
    const at = y(tick).toFixed(1);
    nodes.push(shape('path', { class: 'grid', d: `M${left} ${at}H${right}` }));
    nodes.push(shape('text', { x: left - 6, y: Number(at) + 4, 'text-anchor': 'end' }, labels[index]));
  });
  const minutes = span > 120;
  for (let part = 0; part <= 4; part += 1) {
    const back = span * (4 - part) / 4;
    const at = x(newest - back).toFixed(1);
    const text = back === 0 ? 'now' : minutes ? `\u2212${back / 60} min` : `\u2212${back} s`;
    nodes.push(shape('path', { class: 'grid', d: `M${at} ${MARGIN.top}V${bottom}` }));
    const anchor = part === 4 ? 'end' : 'middle';
    nodes.push(shape('text', { x: at, y: CHART_HEIGHT - 6, 'text-anchor': anchor }, text));
  }
  nodes.push(shape('path', { class: 'frame', d: `M${left} ${MARGIN.top}V${bottom}H${right}` }));
  nodes.push(shape('text', { x: left + 6, y: MARGIN.top + 10 }, unit));
  series.forEach((values, index) => {
    const parts = [];
    let pen = 'M';
    values.forEach((value, place) => {
      if (value === null || newest - times[place] > span) {
        pen = 'M';
        return;
      }
      if (place > 0 && times[place] - times[place - 1] > 5 * period) pen = 'M';
      parts.push(`${pen}${x(times[place]).toFixed(1)} ${y(value).toFixed(1)}`);
      pen = 'L';
    });
    nodes.push(shape('path', { class: `s${index}`, d: parts.join('') || `M${left} ${bottom}` }));
  });
  chart.svg.setAttribute('viewBox', `0 0 ${width} ${CHART_HEIGHT}`);
  chart.svg.setAttribute('aria-label', `${chart.title}, ${unit}: from ${low.toFixed(digits)} to ${high.toFixed(digits)}`);
  chart.svg.replaceChildren(...nodes);
}

// Bars on a logarithmic scale: one late call in a million is what matters.
function drawBars(chart, labels, counts) {
  const width = Math.max(chart.node.clientWidth, 200);
  const decades = Math.max(1, Math.ceil(Math.log10(Math.max(...counts, 1) + 1)));
  const left = 8 + DIGIT_WIDTH * 4;
  const [right, bottom] = [width - MARGIN.right, CHART_HEIGHT - MARGIN.bottom];
  const y = (count) => bottom - (count ? (Math.log10(count) + 0.3) / (decades + 0.3) : 0) * (bottom - MARGIN.top);
  const slot = (right - left) / counts.length;
  const nodes = [];
  const every = Math.ceil((decades + 1) / 6);
  for (let decade = 0; decade <= decades; decade += every) {
    const at = y(10 ** decade).toFixed(1);
    const text = decade < 4 ? String(10 ** decade) : `1e${decade}`;
    nodes.push(shape('path', { class: 'grid', d: `M${left} ${at}H${right}` }));
    nodes.push(shape('text', { x: left - 6, y: Number(at) + 4, 'text-anchor': 'end' }, text));
  }
  const apart = Math.ceil(52 / slot);
  counts.forEach((count, index) => {
    const [at, top] = [left + index * slot, y(count)];
    const bar = { class: 'bar', x: (at + slot * 0.1).toFixed(1), y: top.toFixed(1) };
    nodes.push(shape('rect', { ...bar, width: (slot * 0.8).toFixed(1), height: (bottom - top).toFixed(1) }));
    if (index % apart === 0) {
      nodes.push(shape('text', { x: (at + slot / 2).toFixed(1), y: CHART_HEIGHT - 6, 'text-anchor': 'middle' }, labels[index]));
    }
  });
  nodes.push(shape('path', { class: 'frame', d: `M${left} ${MARGIN.top}V${bottom}H${right}` }));
  chart.svg.setAttribute('viewBox', `0 0 ${width} ${CHART_HEIGHT}`);
  chart.svg.replaceChildren(...nodes);
}

// Lists of samples that grow by what is new, and keep the newest `most`.
class Samples {
  constructor(path, most) {
    this.path = path;
    this.most = most;
    this.next = 0;
    this.lists = null;
    this.busy = false;
  }

  // Fetches what is new; whether there is something.
  async update() {
    if (this.busy) return false;
    this.busy = true;
    try {
      const answer = await fetch(`${this.path}after=${this.next}`);
      if (!answer.ok) throw new Error(answer.statusText);
      const fresh = await answer.json();
      // Another process counts anew.
      if (fresh.next < this.next) this.lists = null;
      this.lists = this.lists ? this.join(this.lists, fresh) : fresh;
      this.next = fresh.next;
      return true;
    } catch {
      // The next event tries again.
      return false;
    } finally {
      this.busy = false;
    }
  }

  join(old, fresh) {
    const joined = { ...fresh };
    for (const [key, value] of Object.entries(fresh)) {
      if (!Array.isArray(value)) continue;
      joined[key] = key === 'buses'
        ? value.map((bus, index) => this.join(old.buses[index], bus))
        : [...old[key], ...value].slice(-this.most);
    }
    return joined;
  }
}
