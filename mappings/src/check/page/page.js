const filter = document.getElementById('filter');
const rows = [...document.querySelectorAll('tbody tr')].map(row => [row, row.textContent.toLowerCase()]);
const tables = [...document.querySelectorAll('table')];
function apply() {
  const text = filter.value.toLowerCase();
  for (const [row, own] of rows) row.hidden = !own.includes(text);
  for (const table of tables) {
    const empty = text !== '' && !table.querySelector('tbody tr:not([hidden])');
    table.hidden = empty;
    if (table.previousElementSibling?.tagName === 'H3') table.previousElementSibling.hidden = empty;
  }
}
filter.addEventListener('input', apply);
document.addEventListener('keydown', event => {
  if (event.key === '/' && event.target !== filter) { event.preventDefault(); filter.focus(); filter.select(); }
  if (event.key === 'Escape') { filter.value = ''; apply(); filter.blur(); }
});
