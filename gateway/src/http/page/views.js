
// ---- which view is shown: the part of the address after # ----------------------------------------------------

const PAGES = [
  ['overview', 'Overview', () => '#/'],
  ['axis', 'Axes', (status) => `#/axis/${status.axes[0] ? status.axes[0].name : ''}`],
  ['bus', 'Buses', (status) => `#/bus/${status.buses[0] ? encodeURIComponent(status.buses[0].name) : ''}`],
  ['time', 'Time', () => '#/time'],
  ['mapping', 'Mapping', (status) => `#/mapping/${status.axes[0] ? status.axes[0].name : ''}`],
  ['downloads', 'Downloads', () => '#/downloads'],
];

const VIEWS = {
  overview: showOverview,
  axis: showAxis,
  bus: showBus,
  time: showTimeView,
  mapping: showMapping,
  downloads: showDownloads,
};

// The newest event, and the view that is shown.
let last = null;
let current = { view: null, name: null };

function wanted() {
  const [, view, ...rest] = window.location.hash.split('/');
  let name = rest.join('/');
  try {
    name = decodeURIComponent(name);
  } catch {
    // It is no name then, and is shown as it is.
  }
  return { view: view || 'overview', name };
}

function show(look) {
  last = look;
  showHead(look);
  showPages(look.status);
  const { view, name } = wanted();
  const known = Object.hasOwn(VIEWS, view) ? view : 'unknown';
  const isNew = current.view !== view || current.name !== name;
  if (isNew) giveBack('Control was given back: another view was opened.');
  if (isNew) {
    for (const node of document.querySelectorAll('.view')) node.hidden = node.id !== `view-${known}`;
  }
  if (known === 'unknown') unknown('There is no such page.');
  else VIEWS[known](look, name);
  if (isNew) arrive(view, name);
}

// Focus goes to the title of a new view, so that the keyboard goes on there and a screen reader says it.
function arrive(view, name) {
  const first = current.view === null;
  current = { view, name };
  if (first) return;
  window.scrollTo(0, 0);
  const title = document.querySelector('.view:not([hidden]) h2');
  title.tabIndex = -1;
  title.focus({ preventScroll: true });
}

function showPages(status) {
  const pages = byId('pages');
  if (!pages.firstChild) pages.appendChild(element('ul'));
  const items = pages.firstChild;
  PAGES.forEach(([view, title, href], index) => {
    const item = items.children[index] || items.appendChild(element('li'));
    const link = item.firstChild || item.appendChild(element('a', '', title));
    const target = href(status);
    if (link.getAttribute('href') !== target) link.setAttribute('href', target);
    mark(link, wanted().view === view);
  });
}

function mark(link, isCurrent) {
  if (isCurrent) link.setAttribute('aria-current', 'page');
  else link.removeAttribute('aria-current');
}

function unknown(text) {
  const view = byId('view-unknown');
  for (const node of document.querySelectorAll('.view')) node.hidden = node !== view;
  const part = element('section', 'wide');
  part.appendChild(element('h2', '', text));
  const link = part.appendChild(element('a', '', 'Overview'));
  link.href = '#/';
  if (view.textContent !== part.textContent) view.replaceChildren(part);
}

// Empties a view and gives it a title, and links to its neighbours; returns the line below the title.
function head(view, title, links) {
  view.replaceChildren();
  const part = element('section', 'wide');
  const line = part.appendChild(element('div', 'head'));
  line.appendChild(element('h2', '', title));
  const subtitle = line.appendChild(element('p'));
  part.appendChild(links);
  view.appendChild(part);
  return subtitle;
}

function choice(view, names, name) {
  const items = element('ul', 'choice');
  if (names.length < 2) return items;
  for (const one of names) {
    const link = items.appendChild(element('li')).appendChild(element('a', '', one));
    link.href = `#/${view}/${encodeURIComponent(one)}`;
    mark(link, one === name);
  }
  return items;
}

// Links to the same view of the other axes, and to the other view of this one.
function axisChoice(view, name) {
  const items = choice(view, last.status.axes.map((axis) => axis.name), name);
  const [other, title] = view === 'axis' ? ['mapping', 'Mapping of this axis'] : ['axis', 'State of this axis'];
  const link = items.appendChild(element('li')).appendChild(element('a', '', title));
  link.href = `#/${other}/${name}`;
  return items;
}

function section(view, id, title, wide) {
  const node = element('section', wide ? 'wide' : '');
  const heading = node.appendChild(element('h2', '', title));
  heading.id = id;
  node.setAttribute('aria-labelledby', id);
  return view.appendChild(node);
}

// A table with these columns, of which those from a place on are numbers; returns its body.
function table(parent, names, numbersFrom = names.length) {
  const node = parent.appendChild(element('table'));
  const row = node.appendChild(element('thead')).appendChild(element('tr'));
  names.forEach((name, column) => {
    const cell = row.appendChild(element('th', column >= numbersFrom ? 'number' : '', name));
    cell.scope = 'col';
  });
  return node.appendChild(element('tbody'));
}

async function fetchOnce(path, use, failed) {
  try {
    const answer = await fetch(path);
    if (!answer.ok) throw new Error(answer.statusText);
    use(await answer.json());
  } catch {
    if (failed) failed();
  }
}

// Asks for what an axis has besides its state, when a view of it is shown the first time; the next state asks again if that has failed.
function askSheet(view, use) {
  if (view.asked) return;
  const { name } = view;
  view.asked = true;
  fetchOnce(`/api/v1/axis?axis=${name}`, (sheet) => {
    if (view.name === name) use(sheet);
  }, () => { if (view.name === name) view.asked = false; });
}

window.addEventListener('hashchange', () => {
  if (last && (window.location.hash === '' || window.location.hash.startsWith('#/'))) show(last);
});
byId('skip').addEventListener('click', (event) => {
  event.preventDefault();
  byId('main').focus();
});
