// The 3D view in a frame of the page's own origin, or the grid; keys pressed in it are the page's.
const HIDE = ".lil-gui, .dg, #stats, .dg.ac { display: none !important }";
const MOVES = [[1, 0], [0, -1], [-1, 0], [0, 1]];

export default {
  template: `
  <section class="view" data-teach="view" :data-phase="state.phase">
    <iframe v-if="view.kind === 'robot'" ref="frame" src="/view/" title="the robot" @load="adopt"></iframe>
    <svg v-else class="grid" :viewBox="'-0.1 -0.1 ' + (view.n + 0.2) + ' ' + (view.n + 0.2)">
      <g v-for="cell in cells">
        <rect :x="cell.x" :y="cell.y" width="1" height="1" class="cell" :class="{shown: cell.shown}"/>
        <path v-if="cell.way" :d="arrow(cell)" class="arrow" :style="{opacity: cell.sure}"
            :class="{shown: cell.shown}"/>
      </g>
      <rect v-if="view.ghost >= 0" class="ghost" v-bind="place(view.ghost)" width="0.5" height="0.5" rx="0.1"/>
      <rect v-if="view.at >= 0" class="mark" :style="{transform: move(view.at)}" x="0.22" y="0.22"
          width="0.56" height="0.56" rx="0.12" data-teach="mark"/>
    </svg>
    <div class="over top"><span class="phase" data-teach="phase" :class="state.phase">{{ said }}</span>
      <span v-if="state.enough" class="phase enough" data-teach="learnt">I have learnt enough · <kbd>g</kbd> says why</span></div>
    <div class="over bottom">
      <span v-if="view.caption" class="caption">{{ view.caption }}</span>
      <span v-if="view.odds" class="odds" data-teach="odds" title="how likely each outcome is">{{ view.odds }}</span>
      <span v-if="state.note" class="note" data-teach="note">{{ state.note }}</span>
    </div>
  </section>`,
  props: { view: Object, state: Object },
  computed: {
    said() {
      return {
        asking: "your turn", moving: "moving, 2 × speed", acting: "on my own: I am sure",
        starting: "starting the physics …", playing: "playing in physics · p pauses",
        pausing: "pausing after this action", paused: "paused · correct me, or p hands back",
        "in doubt": "in doubt · tell me, or p plays on",
      }[this.state.phase] ?? this.state.phase;
    },
    cells() {
      const n = this.view.n, cells = [];
      for (let s = 0; s < n * n; s++) {
        const shown = this.view.shown[s], policy = this.view.policy?.[s];
        const action = shown ?? policy ?? -1;
        const sure = shown === undefined ? 0.15 + 0.7 * (this.view.sure?.[s] ?? 0) : 1;
        cells.push({ x: s % n, y: n - 1 - Math.floor(s / n), shown: shown !== undefined,
                     way: action >= 0 ? MOVES[action] : null, sure });
      }
      return cells;
    },
  },
  methods: {
    adopt() {
      try {
        const inner = this.$refs.frame.contentWindow;
        this.waitForQuestions(inner.viewer);
        const style = inner.document.createElement("style");
        style.textContent = HIDE;
        inner.document.head.appendChild(style);
        inner.addEventListener("keydown", (event) => {
          const copy = new KeyboardEvent("keydown", { key: event.key, code: event.code,
            repeat: event.repeat, ctrlKey: event.ctrlKey, metaKey: event.metaKey,
            altKey: event.altKey, bubbles: true, cancelable: true });
          if (!window.dispatchEvent(copy)) event.preventDefault();
        }, true);
      } catch (error) {
        console.warn("keys in the 3D view do not reach the page", error);
      }
    },
    // The next question comes first: a view that is drawn without a graphics card holds it up.
    waitForQuestions(viewer) {
      const draw = viewer.animate;
      viewer.animate = () => performance.now() > (window.teach?.hurry ?? 0) && draw.call(viewer);
    },
    arrow({ x, y, way: [dx, dy] }) {
      const cx = x + 0.5, cy = y + 0.5, tip = [cx + 0.3 * dx, cy + 0.3 * dy];
      const side = (k) => [cx - 0.02 * dx + k * 0.22 * dy, cy - 0.02 * dy + k * 0.22 * dx];
      const tail = [cx - 0.28 * dx, cy - 0.28 * dy];
      return `M${tail} L${cx},${cy} M${side(1)} L${tip} L${side(-1)} Z`;
    },
    place(state) {
      const n = this.view.n;
      return { x: (state % n) + 0.25, y: n - 1 - Math.floor(state / n) + 0.25 };
    },
    move(state) {
      const n = this.view.n;
      return `translate(${state % n}px, ${n - 1 - Math.floor(state / n)}px)`;
    },
  },
};
